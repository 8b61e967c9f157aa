// Tests external renderers as methods of `halflight converge`; a command that copies a picture stands in for a
// renderer.
#include <gtest/gtest.h>

#include <chrono>
#include <limits>
#include <thread>

#include "engine/io/exr.h"
#include "tests/cli/process.h"
#include "tests/support/error_message.h"
#include "tools/measure/converge/external.h"

namespace halflight::converge::test {
namespace {

using halflight::test::TemporaryFolder, halflight::test::write_text;

class ExternalTest : public testing::Test {
  protected:
    ExternalTest() { write(4, 3); }

    void write(int width, int height) {
        Image image(width, height, 3);
        for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = 0.25f * static_cast<float>(i);
        write_exr(folder / "an 'odd' name.exr", {{{"R", "G", "B"}, image}}, {});
    }
    /// Runs `first`, then copies the picture to its destination; {samples} is in a place without effect.
    Painted paint(
        const std::string& first, const Pulse& pulse = [] {}) const {
        const External external{"other", first + "; : {samples} {seed} {environment}; cp {scene} {output}"};
        return external_painter(external, scene, view)->paint({7, 0}, 11, pulse);
    }
    std::string refusal(const std::string& command) const {
        const auto paint = [&] { external_painter({"other", command}, scene, view)->paint({7, 0}, 11, [] {}); };
        const std::string message = error_message(paint);
        return message.empty() ? "none" : message;
    }

    TemporaryFolder folder;
    ExternalScene scene{folder / "an 'odd' name.exr", "a camera", {.name = {}, .color = vec3(1, 2, 3), .map = {}}};
    View view{4, 3, {}, 5, {}};
};

TEST_F(ExternalTest, CommandsReceiveTheirParameters) {
    const std::string told = folder / "told";
    const Painted painted = paint(
        "echo {samples} {seed} {width} {height} $(({bounces} - 1)) {camera} {unknown} ${HOME:+home} > '" + told + "'");
    EXPECT_EQ(halflight::test::read_text(told), "7 11 4 3 4 a camera {unknown} home\n");
    EXPECT_EQ(painted.picture.samples, 7);
    EXPECT_FALSE(painted.picture.has_components());
    ASSERT_EQ(painted.picture.beauty.pixels.size(), 36u);
    EXPECT_EQ(painted.picture.beauty.pixels[35], 0.25f * 35);
    const std::string environment = folder / "environment.exr";
    paint("cp {environment} '" + environment + "'");
    const Image map = read_exr(environment).image({"R", "G", "B"});
    for (std::size_t i = 0; i < map.pixels.size(); ++i) EXPECT_EQ(map.pixels[i], float(i % 3 + 1));
}

TEST_F(ExternalTest, ReportedTimesAreUsed) {
    const Painted own = paint(R"(echo hello; echo '{"seconds": 1.5}'; echo '{"cpu_seconds": 3.25, "spp": 7}')");
    EXPECT_EQ(own.time.wall, 1.5);
    EXPECT_EQ(own.time.cpu, 3.25);
    const Painted measured = paint("sleep 0.2");
    EXPECT_GE(measured.time.wall, 0.2);
    EXPECT_GE(measured.time.cpu, 0);
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

TEST_F(ExternalTest, FailuresQuoteTheCommandsOutput) {
    EXPECT_EQ(refusal("echo first >&2; echo 'no licence' >&2; exit 3 # {samples} {seed} {environment} {output}"),
              "other: exit status 3; it says: no licence");
    EXPECT_EQ(refusal("kill -9 $$ # {samples} {seed} {environment} {output}"), "other: was ended by signal 9");
    EXPECT_EQ(refusal(": {samples} {seed} {environment} {output}"), "other: has written no picture");
    EXPECT_EQ(refusal("echo lost; : {samples} {seed} {environment} {output}"),
              "other: has written no picture; it says: lost");
    EXPECT_EQ(refusal("cp {scene} {output}"), "other: its command lacks {samples}");
    EXPECT_EQ(refusal("cp {scene} {output} {samples}"), "other: its command lacks {seed}");
    EXPECT_EQ(refusal("echo {samples}"), "other: its command lacks {output}");
    const std::string copies = "cp {scene} {output} # {samples} {seed}";
    EXPECT_EQ(refusal(copies), "other: its command lacks {environment}, and the scene has one");
    scene.environment.color = vec3(0);
    EXPECT_EQ(refusal(copies), "none");
    write(3, 4);
    EXPECT_EQ(refusal(copies), "other: its picture is of 3x4 pixels, not of 4x3");
    write_text(scene.file, "no picture");
    EXPECT_TRUE(refusal(copies).starts_with("other: its picture cannot be used: ")) << refusal(copies);
    scene.camera.clear();
    EXPECT_EQ(refusal(copies), "other: can be told of a camera by its name alone, and this one has none");
}

TEST_F(ExternalTest, LeavesNothingRunning) {
    const std::string late = folder / "late";
    paint("(sleep 3; touch '" + late + "') >/dev/null 2>&1 & true");
    std::this_thread::sleep_for(std::chrono::milliseconds(3500));
    EXPECT_FALSE(std::filesystem::exists(late));
}

TEST_F(ExternalTest, EndsAllChildProcessesWhenThePulseThrows) {
    const std::string late = folder / "late";
    int pulses = 0;
    const auto stop = [&] {
        if (++pulses == 2) throw Error("test", "stop");
    };
    EXPECT_THROW(paint("(sleep 3; touch '" + late + "') & wait", stop), Error);
    EXPECT_EQ(pulses, 2);
    std::this_thread::sleep_for(std::chrono::milliseconds(3500));
    EXPECT_FALSE(std::filesystem::exists(late));
}

}  // namespace
}  // namespace halflight::converge::test
