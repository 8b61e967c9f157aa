// Tests preview modes of pictures and sequences: the output names them, and it is reproducible.
#include <nlohmann/json.hpp>

#include "tests/cli/sequence_test.h"

namespace halflight::test {
namespace {

using PreviewModes = Sequence;

std::string bias_of(const fs::path& file) {
    return read_exr(file).attributes.extra["bias"];
}

TEST_F(PreviewModes, AreNamedInFilesAndOnTheConsole) {
    const auto render = [&](const std::string& into, const Strings& more) {
        Strings arguments = {"render", scene, folder / into, "--width", "24", "--height", "16", "--samples", "2"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Outcome outcome = run_program(arguments);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return outcome.err;
    };
    render("plain.exr", {});
    render("none.exr", {"--preview", "none"});
    const std::string err = render("filtered.exr", {"--preview", "filter", "--stats", folder / "stats.json"});
    EXPECT_TRUE(same_pixels(folder / "none.exr", folder / "plain.exr"));
    EXPECT_FALSE(same_pixels(folder / "filtered.exr", folder / "plain.exr"));
    const std::string bias = "preview: noise is filtered out until there are 256 samples";
    EXPECT_EQ(bias_of(folder / "plain.exr"), "");
    EXPECT_EQ(bias_of(folder / "filtered.exr"), bias);
    EXPECT_NE(err.find("biased: " + bias), std::string::npos) << err;
    const auto stats = nlohmann::json::parse(read_text(folder / "stats.json"));
    EXPECT_EQ(stats["settings"]["preview"], "filter");
    EXPECT_EQ(stats["biases"], nlohmann::json{bias});
    EXPECT_EQ(stats["bad_values"]["earlier pictures"]["nan"], 0);
}

TEST_F(PreviewModes, FramesContinueEarlierFramesAndAreReproducible) {
    const Strings temporal = {"--preview", "temporal,filter", "--animation", "all", "--camera", "moving"};
    make("off", "1-4", {"--animation", "all", "--camera", "moving", "--preview", "filter"});
    const std::string output = make("on", "1-4", temporal).err, bias = "biased: preview: light of earlier pictures";
    EXPECT_NE(output.find(bias), std::string::npos) << output;
    EXPECT_EQ(output.find(bias), output.rfind(bias)) << "once, as long as it stays the same";
    EXPECT_TRUE(same_pixels(file("on", 1), file("off", 1))) << "there is nothing before the first frame";
    for (const int frame : {2, 3, 4}) {
        EXPECT_FALSE(same_pixels(file("on", frame), file("off", frame))) << frame;
        EXPECT_TRUE(bias_of(file("on", frame)).starts_with("preview: light of earlier pictures")) << frame;
    }
    const auto before = contents("on");
    EXPECT_NE(make("on", "1-4", temporal).err.find("4 of 4 frames are there already"), std::string::npos);
    fs::remove(file("on", 3));
    EXPECT_NE(make("on", "1-4", temporal).err.find("all are made again"), std::string::npos);
    EXPECT_TRUE(contents("on") == before);
    const Outcome others = run("on", "3-4", temporal);
    EXPECT_EQ(others.status, 1) << "of other frames before them";
    EXPECT_NE(others.err.find("exists, but is not this frame"), std::string::npos) << others.err;
    EXPECT_NE(others.err.find("these --frames"), std::string::npos) << others.err;
    EXPECT_EQ(run("on", "1-4", {"--animation", "all", "--camera", "moving"}).status, 1) << "of no preview mode";
    EXPECT_TRUE(contents("on") == before);
}

TEST_F(PreviewModes, IncompatibleOptionsAreErrors) {
    const auto refused = [&](const std::string& frames, const Strings& more, const std::string& what) {
        const Outcome outcome = run("none", frames, more);
        EXPECT_EQ(outcome.status, 2);
        EXPECT_NE(outcome.err.find(what), std::string::npos) << outcome.err;
    };
    refused("1-2", {"--preview", "blur"},
            "--preview: blur: 'blur' is no preview mode; there are: cache, temporal, filter");
    refused("1-2", {"--preview", "temporal", "--part", "1/2"}, "--preview: cannot be given together with --part");
    refused("1-2", {"--preview", "filter", "--shutter", "0.5"}, "--preview: cannot be given together with --shutter");
    refused("1-2", {"--preview", "filter", "--error", "1"}, "--preview: cannot be given together with --error");
    const Outcome alone = run_program({"render", scene, folder / "a.exr", "--preview", "temporal"});
    EXPECT_EQ(alone.status, 2);
    EXPECT_NE(alone.err.find("--preview: temporal reuses light of earlier frames and needs --frames"),
              std::string::npos)
        << alone.err;
}

}  // namespace
}  // namespace halflight::test
