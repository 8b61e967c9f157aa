// Tests external renderers as methods of `halflight converge`. A script that copies a picture stands for the renderer.
#include <gtest/gtest.h>

#include <limits>
#include <regex>
#include <sstream>

#include "engine/io/exr.h"
#include "tests/support/error_message.h"
#include "tests/support/process.h"
#include "tools/measure/converge/external.h"

namespace halflight::converge::test {
namespace {

using halflight::test::read_text, halflight::test::write_text;

const std::string kCopy = "cp \"$1\" \"$2\"", kInputs = "{environment} {samples} {seed}";

/// Fixture whose renderer is a script: $1 is the scene, $2 the output, $3 the environment.
class ExternalTest : public testing::Test {
  protected:
    ExternalTest() { write(4, 3); }

    void write(int width, int height, const ExrAttributes& attributes = {}) {
        Image image(width, height, 3);
        for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = 0.25f * static_cast<float>(i);
        write_exr(scene.file, {{{"R", "G", "B"}, image}}, attributes);
    }
    /// Writes the script, and returns the command that calls it.
    std::string command(const std::string& script, const std::string& more = kInputs) const {
        const std::filesystem::path file = folder / "render";
        write_text(file, "#!/bin/sh\n" + script + "\n");
        std::filesystem::permissions(file, std::filesystem::perms::owner_all);
        return "'" + file.string() + "' {scene} {output} " + more;
    }
    Painted paint_by(const std::string& line, const Pulse& pulse = {}) const {
        return external_painter({"other", line}, scene, view)->paint({7, 0}, 11, pulse);
    }
    /// Renders by a script that runs the lines `first` and then copies the picture to the output.
    Painted paint(const std::string& first, const Pulse& pulse = {}) const {
        return paint_by(command(first + "\n" + kCopy), pulse);
    }
    std::string refusal(const std::string& line) const {
        const std::string message = error_message([&] { paint_by(line); });
        return message.empty() ? "none" : message;
    }

    TemporaryFolder folder;
    ExternalScene scene{folder / "an 'odd' name.exr", {.name = {}, .color = vec3(1, 2, 3), .map = {}}};
    View view{4, 3, {.name = "a camera"}, 5, {}};
};

TEST_F(ExternalTest, CommandsReceiveTheirParameters) {
    const std::string told = folder / "told", environment = folder / "environment.exr";
    const Painted painted = paint_by(
        command("cp \"$1\" \"$2\"; cp \"$3\" '" + environment + "'; shift 3; printf '%s\\n' \"$@\" > '" + told + "'",
                "{environment} {samples} {seed} {width}x{height} 'a {bounces} b' {bounces-1} --camera={camera} "
                "{unknown} '$HOME' {threads}"));
    EXPECT_TRUE(std::regex_match(
        read_text(told), std::regex("7\n11\n4x3\na 5 b\n4\n--camera=a camera\n\\{unknown\\}\n\\$HOME\n[1-9][0-9]*\n")))
        << read_text(told);
    EXPECT_EQ(painted.picture.samples, 7);
    EXPECT_FALSE(painted.picture.has_components());
    ASSERT_EQ(painted.picture.beauty.pixels.size(), 36u);
    EXPECT_EQ(painted.picture.beauty.pixels[35], 0.25f * 35);
    const Image map = read_exr(environment).image({"R", "G", "B"});
    ASSERT_EQ(map.pixels.size(), 6u);
    for (std::size_t i = 0; i < map.pixels.size(); ++i) EXPECT_EQ(map.pixels[i], float(i % 3 + 1));
}

TEST_F(ExternalTest, NamesAreNeverExecuted) {
    const std::filesystem::path before = std::filesystem::current_path();
    std::filesystem::current_path(folder.path);
    const std::string told = folder / "told";
    const std::string line = command(kCopy + "; printf '%s|' \"$1\" \"$6\" \"$7\" > '" + told + "'",
                                     "{environment} {samples} {seed} {camera} '{camera}'");
    for (const std::string name :
         {"x'; id > pwned; '", "; id > pwned;", "$(id > pwned)", "`id > pwned`", "\"; id > pwned; \"", "| id > pwned",
          "&& id > pwned", "a\nid > pwned", "{output} \\' > pwned"}) {
        scene.file = folder / (std::string(name) + ".exr");
        view.camera.name = name;
        write(4, 3);
        EXPECT_EQ(refusal(line), "none");
        EXPECT_EQ(read_text(told), scene.file.string() + "|" + name + "|" + name + "|");
        EXPECT_FALSE(std::filesystem::exists("pwned")) << name;
    }
    std::filesystem::current_path(before);
}

TEST_F(ExternalTest, NamesOfCamerasAreNoOptions) {
    view.camera.name = "--help";
    EXPECT_NE(refusal(command(kCopy, kInputs + " --camera {camera}")).find("'--help'"), std::string::npos);
    EXPECT_EQ(refusal(command(kCopy, kInputs + " --camera={camera}")), "none");
}

TEST_F(ExternalTest, CamerasWithoutANameAreDescribedByTheirPose) {
    const std::string told = folder / "told", posed = kInputs + " {look-from} {look-at} {vfov}";
    const std::string copies = kCopy + "; shift 5; echo \"$@\" > '" + told + "'";
    view.camera = look_at_camera({1, 2, 3}, {1, 2, -4}, {0, 1, 0}, glm::radians(60.0));
    EXPECT_NE(refusal(command(copies)).find("lacks {look-from}"), std::string::npos);
    EXPECT_EQ(refusal(command(copies, posed)), "none");
    std::istringstream words(std::regex_replace(read_text(told), std::regex(","), " "));
    for (const double expected : {1.0, 2.0, 3.0, 1.0, 2.0, 2.0, 60.0}) {
        double found = 0;
        words >> found;
        EXPECT_NEAR(found, expected, 1e-12) << read_text(told);
    }
    view.camera = look_at_camera({1, 2, 3}, {1, 2, -4}, {1, 0, 0}, glm::radians(60.0));
    EXPECT_NE(refusal(command(copies, posed)).find("lacks {up}"), std::string::npos);
    EXPECT_EQ(refusal(command(copies, posed + " {up}")), "none");
    EXPECT_TRUE(read_text(told).ends_with(" 1,0,0\n")) << read_text(told);
    view.camera.orthographic = true;
    EXPECT_NE(refusal(command(copies, posed)).find("orthographic"), std::string::npos);
}

TEST_F(ExternalTest, ReportedTimesAreUsed) {
    const Painted own = paint(R"(echo hello; echo '{"seconds": 1.5}'; echo '{"cpu_seconds": 3.25, "spp": 7}')");
    EXPECT_EQ(own.time.wall, 1.5);
    EXPECT_EQ(own.time.cpu, 3.25);
    const Painted measured = paint("sleep 0.2");
    EXPECT_GE(measured.time.wall, 0.2);
    EXPECT_GT(measured.time.cpu, 0);
    EXPECT_LT(measured.time.cpu, measured.time.wall) << "it sleeps";
}

TEST_F(ExternalTest, NonFiniteValuesAreCounted) {
    Image image(4, 3, 3);
    image.pixels[5] = std::numeric_limits<float>::quiet_NaN();
    image.pixels[6] = std::numeric_limits<float>::infinity();
    write_exr(scene.file, {{{"R", "G", "B"}, image}}, {});
    const Painted painted = paint(":");
    EXPECT_EQ(painted.picture.non_finite, 2u);
    for (const float value : painted.picture.beauty.pixels) EXPECT_EQ(value, 0);
}

TEST_F(ExternalTest, PixelsOutsideTheDisplayWindowAreLeftOut) {
    ExrAttributes attributes;
    attributes.origin = {-1, -2}, attributes.display = ivec2(4, 3);
    write(6, 6, attributes);
    const Image beauty = paint(":").picture.beauty;
    ASSERT_EQ(ivec2(beauty.width, beauty.height), ivec2(4, 3));
    EXPECT_EQ(beauty.pixels[0], 0.25f * 3 * (2 * 6 + 1));
}

TEST_F(ExternalTest, FailuresAreNamed) {
    const auto expect_refusal = [&](const std::string& line, const std::string& what) {
        const std::string message = refusal(line);
        EXPECT_NE(message.find(what), std::string::npos) << line << ": " << message;
    };
    expect_refusal(command("echo first >&2; echo 'no licence' >&2; exit 3"),
                   "other: exit status 3; it says: no licence");
    expect_refusal(command("kill -9 $$"), "signal 9");
    expect_refusal(command(":"), "no picture");
    expect_refusal("'no such program' {environment} {output} {samples} {seed}", "no such program");
    expect_refusal("cp {scene} {output}", "{samples}");
    expect_refusal("cp {scene} {output} {samples}", "{seed}");
    expect_refusal("echo {samples}", "{output}");
    expect_refusal(" ", "empty");
    expect_refusal("cp 'a {samples}", "not closed");
    const std::string copies = command(kCopy, "{samples} {seed}");
    expect_refusal(copies, "{environment}");
    scene.environment.color = vec3(0);
    expect_refusal(copies, "none");
    write(3, 4);
    expect_refusal(copies, "3x4 pixels instead of 4x3");
    ExrAttributes attributes;
    attributes.origin = {1, 0}, attributes.display = ivec2(4, 3);
    write(3, 3, attributes);
    expect_refusal(copies, "is a crop: it has the pixels 1,0 to 4,3 of 4 x 3");
    attributes = {};
    attributes.chromaticities = kAp1;
    write(4, 3, attributes);
    expect_refusal(copies, "is not in linear Rec.709");
    write_text(scene.file, "no picture");
    expect_refusal(copies, "other: its picture cannot be used: ");
}

TEST_F(ExternalTest, PulseCanStopIt) {
    int pulses = 0;
    const auto stop = [&] {
        if (++pulses == 2) throw Error("test", "stop");
    };
    EXPECT_THROW(paint("sleep 60", stop), Error);
    EXPECT_EQ(pulses, 2);
}

}  // namespace
}  // namespace halflight::converge::test
