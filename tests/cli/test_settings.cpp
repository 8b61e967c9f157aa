// Tests `halflight render --settings`: camera, lights and samples of the file, overridden by the command line.
#include <gtest/gtest.h>

#include "engine/core/image_tools.h"
#include "engine/io/exr.h"
#include "tests/support/process.h"

namespace halflight::test {
namespace {

class Settings : public testing::Test {
  protected:
    std::string file(const std::string& name) const { return folder / name; }
    Outcome run(const std::string& output, std::vector<std::string> more) {
        more.insert(more.begin(), {"render", scene, file(output), "--width", "32", "--height", "24", "--quiet"});
        return run_program(more);
    }
    ExrFile render(const std::string& output, const std::vector<std::string>& more) {
        const Outcome outcome = run(output, more);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return read_exr(file(output));
    }
    static bool same(const ExrFile& a, const ExrFile& b) {
        return same_bits(a.image({"R", "G", "B", "A"}), b.image({"R", "G", "B", "A"}));
    }
    std::string settings(const std::string& more) {
        write_text(folder / "s.json", "{\"halflight_settings\": 1, " + more + "}");
        return file("s.json");
    }

    TemporaryFolder folder;
    std::string scene = copy_room(folder.path);
};

TEST_F(Settings, AreEquivalentToOptions) {
    const std::string s = settings(R"("camera": "above", "samples": 3, "bounces": 1, "exposure": 1,
                                      "environment": {"color": [0.2, 0.6, 0.4], "intensity": 2, "tint": [1, 0.5, 1]})");
    const ExrFile expected =
        render("a.exr", {"--camera", "above", "--samples", "3", "--bounces", "1", "--env", "0.4,0.6,0.8"});
    const ExrFile by_file = render("b.exr", {"--settings", s});
    EXPECT_TRUE(same(by_file, expected));
    EXPECT_NE(by_file.attributes.comments.find("3 samples, 1 bounces"), std::string::npos)
        << by_file.attributes.comments;

    const ExrFile own = render("c.exr", {"--settings", s, "--camera", "front", "--samples", "2", "--bounces", "0"});
    EXPECT_FALSE(same(own, expected));
    EXPECT_TRUE(
        same(own, render("d.exr", {"--camera", "front", "--samples", "2", "--bounces", "0", "--env", "0.4,0.6,0.8"})));

    ASSERT_EQ(run("a.png",
                  {"--samples", "3", "--exposure", "1", "--bounces", "1", "--camera", "above", "--env", "0.4,0.6,0.8"})
                  .status,
              0);
    ASSERT_EQ(run("b.png", {"--settings", s}).status, 0);
    EXPECT_EQ(read_text(file("a.png")), read_text(file("b.png")));
}

TEST_F(Settings, HaveSizeAndBiases) {
    const std::string s = settings(R"("samples": 2, "size": [40, 20], "preview": "filter,temporal", "clamp": 0.01)");
    const auto picture = [&](const std::string& name, std::vector<std::string> more) {
        more.insert(more.begin(), {"render", scene, file(name), "--quiet"});
        const Outcome outcome = run_program(more);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return read_exr(file(name));
    };
    const auto size = [&](const std::vector<std::string>& more) {
        std::vector<std::string> all = {"--settings", s, "--bounces", "0", "--samples", "1"};
        all.insert(all.end(), more.begin(), more.end());
        const ExrFile exr = picture("size.exr", all);
        return std::pair(exr.width, exr.height);
    };
    EXPECT_EQ(size({}), std::pair(40, 20));
    EXPECT_EQ(size({"--width", "10"}), std::pair(10, 5)) << "the file's shape";
    EXPECT_EQ(size({"--height", "10"}), std::pair(20, 10));
    EXPECT_EQ(size({"--width", "10", "--height", "10"}), std::pair(10, 10));

    const auto bias = [](const ExrFile& exr) { return exr.attributes.extra.contains("bias"); };
    const std::vector<std::string> biased = {"--width", "40",        "--height", "20",      "--samples",
                                             "2",       "--preview", "filter",   "--clamp", "0.01"};
    const ExrFile by_file = picture("a.exr", {"--settings", s});
    EXPECT_TRUE(bias(by_file));
    EXPECT_TRUE(same(by_file, picture("b.exr", biased))) << "temporal is for frames";
    EXPECT_FALSE(bias(picture("c.exr", {"--settings", s, "--preview", "none", "--clamp", "0"})));
    // Options for an error target or a shutter take precedence over modes of the file that exclude them.
    EXPECT_FALSE(bias(picture("d.exr", {"--settings", s, "--clamp", "0", "--error", "1e9", "--samples", "16"})));
    const std::vector<std::string> finals[] = {{"--denoise"},           {"--crop", "0,0,16,16"},
                                               {"--overscan", "2"},     {"--adaptive", "--samples", "16"},
                                               {"--sample-parts", "2"}, {"--checkpoint", "60"}};
    for (std::vector<std::string> more : finals) {
        more.insert(more.end(), {"--settings", s, "--clamp", "0"});
        ExrFile made = picture("f.exr", more);
        EXPECT_EQ(made.attributes.extra["bias"].find("preview"), std::string::npos) << more[0];
    }
    EXPECT_EQ(run("p.exr", {"--settings", s, "--part", "1/2"}).status, 0);
    EXPECT_EQ(run("e.#.exr", {"--settings", s, "--frames", "1-2", "--shutter", "0.5", "--shutter-times", "2"}).status,
              0);
    const Outcome part = run("f.#.exr", {"--settings", s, "--frames", "1-2", "--part", "1/2"});
    EXPECT_EQ(part.status, 2);
    EXPECT_NE(part.err.find("holds the preview mode temporal"), std::string::npos) << part.err;
    const std::vector<std::string> filtered = {"--settings", s,     "--frames",  "1-2",
                                               "--part",     "1/2", "--preview", "filter"};
    EXPECT_EQ(run("f.#.exr", filtered).status, 0);
    EXPECT_EQ(run("g.#.exr", {"--settings", s, "--frames", "1-2"}).status, 0);
    EXPECT_NE(read_exr(file("g.2.exr")).attributes.extra["bias"].find("earlier pictures"), std::string::npos);
}

TEST_F(Settings, HaveALensWhoseApertureAnFNumberReplaces) {
    const std::string s = settings(R"("focus": "2", "aperture": 40, "exposure": 1)");
    const ExrFile wide = render("a.exr", {"--settings", s}),
                  narrow = render("b.exr", {"--settings", s, "--fstop", "8"});
    EXPECT_TRUE(same(wide, render("c.exr", {"--focus", "2", "--aperture", "40"})));
    EXPECT_TRUE(same(narrow, render("c.exr", {"--focus", "2", "--fstop", "8"})));
    EXPECT_FALSE(same(wide, narrow));
    ASSERT_EQ(run("b.png", {"--settings", s, "--fstop", "8"}).status, 0);
    ASSERT_EQ(run("c.png", {"--focus", "2", "--fstop", "8", "--exposure", "1"}).status, 0);
    EXPECT_EQ(read_text(file("b.png")), read_text(file("c.png"))) << "an f-number beside a focus sets no exposure";
}

TEST_F(Settings, HaveCamerasOfTheirOwn) {
    const std::string s = settings(
        R"("samples": 2, "camera": {"from": [1, 2, 5], "at": [0, 0.5, 0], "up": [0, 1, 0], "vfov": 0.7853981633974483})");
    EXPECT_TRUE(same(render("a.exr", {"--settings", s}),
                     render("b.exr", {"--look-from", "1,2,5", "--look-at", "0,0.5,0", "--samples", "2"})));
    const std::string degrees = settings(
        R"("samples": 2, "camera": {"from": [1, 2, 5], "at": [0, 0.5, 0], "up": [0, 1, 0], "vfov_degrees": 33.3})");
    EXPECT_TRUE(
        same(render("a.exr", {"--settings", degrees}),
             render("b.exr", {"--look-from", "1,2,5", "--look-at", "0,0.5,0", "--vfov", "33.3", "--samples", "2"})));
}

TEST_F(Settings, EditTheLightOfSequencesToo) {
    const std::string plain = settings(R"("samples": 1)");
    const auto sequence = [&](const std::string& name) {
        return run(name + ".##.exr", {"--settings", file("s.json"), "--frames", "1-2", "--reproducible"});
    };
    ASSERT_EQ(sequence("a").status, 0);
    settings(R"("samples": 1, "emission": 0.5)");
    EXPECT_EQ(sequence("a").status, 1) << "those are other frames";
    ASSERT_EQ(sequence("b").status, 0);
    const Image bright = read_exr(file("a.01.exr")).image({"R", "G", "B"});
    const Image dim = read_exr(file("b.01.exr")).image({"R", "G", "B"});
    for (std::size_t i = 0; i < dim.pixels.size(); ++i) EXPECT_NEAR(dim.pixels[i], bright.pixels[i] / 2, 1e-4);
}

TEST_F(Settings, InvalidFilesAreRefused) {
    const auto refused = [&](const std::string& name) {
        const Outcome outcome = run("a.exr", {"--settings", name});
        EXPECT_EQ(outcome.status, 1);
        return outcome.err;
    };
    EXPECT_TRUE(refused(file("no.json")).starts_with("halflight: " + file("no.json")));
    EXPECT_EQ(refused(settings("\"samples\": 0")),
              "halflight: " + file("s.json") + ": samples: is no number from 1 to 16777216\n");
    EXPECT_EQ(
        refused(settings("\"camera\": \"nobody\"")),
        "halflight: " + file("s.json") + ": " + scene + ": no camera 'nobody': its cameras: 0 'front', 1 'above'\n");
    EXPECT_EQ(refused(settings(R"("materials": {"2": {"roughness": 0.5}})")),
              "halflight: " + file("s.json") + ": materials: " + scene +
                  ": there is no material 2; the scene has 2, numbered from 0\n");
    const Outcome both = run("s.exr", {"--settings", file("s.exr")});
    EXPECT_EQ(both.status, 2) << "it is both input and output";

    // The file's contents are checked together with the rest of the command line.
    write_exr(file("sky.exr"), {ExrLayer{{"R", "G", "B"}, Image(2, 1, 3)}}, {});
    const std::string sky = read_text(file("sky.exr"));
    EXPECT_EQ(run("sky.exr", {"--settings", settings(R"("environment": {"map": "sky.exr"})")}).status, 2);
    EXPECT_EQ(read_text(file("sky.exr")), sky);
    const std::string few = settings("\"samples\": 3");
    EXPECT_EQ(run("a.##.exr", {"--settings", few, "--frames", "1", "--shutter", "0.5", "--shutter-times", "5"}).err,
              "halflight: --shutter-times: 3 samples are too few for 5 times\n");
}

}  // namespace
}  // namespace halflight::test
