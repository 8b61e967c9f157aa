// Tests denoised sequences: frames take light from their neighbours and do not depend on the run.
#include <nlohmann/json.hpp>

#include <sstream>

#include "tests/cli/sequence_test.h"

namespace halflight::test {
namespace {

using DenoisedSequence = Sequence;

const Strings kMoving = {"--animation", "all", "--camera", "moving", "--denoise"};

Strings with(Strings more) {
    more.insert(more.begin(), kMoving.begin(), kMoving.end());
    return more;
}

TEST_F(DenoisedSequence, FramesDoNotDependOnTheRun) {
    const Strings all = with({"--aov", "noisy,denoiser,motion,ids"});
    make("whole", "0-9", all);
    const auto whole = contents("whole");
    ASSERT_EQ(whole.size(), 10u);
    for (const char* chunk : {"0-3", "4-6", "7-9"}) make("chunks", chunk, all);
    EXPECT_TRUE(contents("chunks") == whole) << "in chunks";
    for (const char* part : {"2/3", "1/3", "3/3"}) {
        Strings one = all;
        one.insert(one.end(), {"--part", part});
        make("parts", "0-9", one);
    }
    EXPECT_TRUE(contents("parts") == whole) << "in parts";
    make("backwards", "9,8,7,6,5,4,3,2,1,0", all);
    EXPECT_TRUE(contents("backwards") == whole) << "backwards";
    make("resumed", "0-9", all);
    for (const int frame : {2, 3, 7, 9}) fs::remove(file("resumed", frame));
    make("resumed", "0-9", all);
    EXPECT_TRUE(contents("resumed") == whole) << "resumed";
    make("small", "0-9", with({"--aov", "noisy,denoiser,motion,ids", "--memory", "300M"}));
    EXPECT_TRUE(contents("small") == whole) << "in smaller bands";
}

TEST_F(DenoisedSequence, NeighboursAreNamedAndChangeTheFrame) {
    const std::string err = make("two", "3-5", with({"--aov", "noisy", "--stats", folder / "stats.json"})).err;
    const std::string bias =
        "denoised: noise of reflected light filtered by non-local means, also over 4 neighbouring frames";
    EXPECT_NE(err.find("biased: " + bias), std::string::npos) << err;
    auto header = read_exr(file("two", 4)).attributes;
    EXPECT_EQ(header.extra["bias"], bias);
    EXPECT_NE(header.comments.find("denoised with 2 frames before and after"), std::string::npos) << header.comments;
    std::istringstream lines(read_text(folder / "stats.json"));
    std::vector<nlohmann::json> stats;
    for (std::string line; std::getline(lines, line);) stats.push_back(nlohmann::json::parse(line));
    ASSERT_EQ(stats.size(), 3u);
    EXPECT_EQ(stats[0]["settings"]["denoise_frames"], 2);
    EXPECT_EQ(stats[0]["denoise_neighbours"]["frames"], 4);
    EXPECT_EQ(stats[0]["denoise_neighbours"]["rendered_frames"], 5);
    EXPECT_EQ(stats[1]["denoise_neighbours"]["rendered_frames"], 1) << "the others are held";
    EXPECT_GT(stats[1]["denoise_neighbours"]["seconds"], 0);
    const std::string judged = make("judged", "3-5", with({"--denoise-error", "2"})).err;
    EXPECT_NE(judged.find("denoised picture: estimated relmse"), std::string::npos) << judged;
    for (const int frame : {3, 4, 5})
        EXPECT_TRUE(same_bits(read_exr(file("judged", frame)).find("R")->values,
                              read_exr(file("two", frame)).find("R")->values))
            << frame;

    make("none", "3-5", with({"--aov", "noisy", "--denoise-frames", "0"}));
    EXPECT_EQ(read_exr(file("none", 4)).attributes.extra["bias"],
              "denoised: noise of reflected light filtered by non-local means");
    make("noisy", "3-5", {"--animation", "all", "--camera", "moving"});
    const ExrFile two = read_exr(file("two", 4)), none = read_exr(file("none", 4)), noisy = read_exr(file("noisy", 4));
    EXPECT_FALSE(same_bits(two.find("R")->values, none.find("R")->values));
    for (const char* channel : {"R", "G", "B"})
        EXPECT_TRUE(same_bits(two.find(std::string("noisy.") + channel)->values, noisy.find(channel)->values));

    // A single picture of an animated scene can be the frame of a sequence, too.
    const Outcome alone = run_program(
        {"render",    scene,  folder / "alone.exr", "--frame",          "4", "--width",     "16",  "--height", "16",
         "--samples", "2",    "--denoise",          "--denoise-frames", "2", "--animation", "all", "--camera", "moving",
         "--aov",     "noisy"});
    ASSERT_EQ(alone.status, 0) << alone.err;
    EXPECT_TRUE(same_pixels(folder / "alone.exr", file("two", 4)));
}

TEST_F(DenoisedSequence, WhatDoesNotFitIsRefused) {
    const Outcome large = run_program({"render", scene, folder / "f.#.exr", "--frames", "1", "--width", "1024",
                                       "--height", "1024", "--samples", "2", "--denoise", "--memory", "1G"});
    EXPECT_EQ(large.status, 1);
    EXPECT_NE(large.err.find("picture with 2 frames before and after "), std::string::npos) << large.err;
    const Outcome alone = run("alone", "1-2", {"--denoise-frames", "1"});
    EXPECT_EQ(alone.status, 2);
    EXPECT_NE(alone.err.find("--denoise-frames: needs --denoise"), std::string::npos) << alone.err;
}

TEST_F(DenoisedSequence, AFrameThatCannotBePosedFailsAlone) {
    scene = write_scene_with_bad_frame(folder.path);
    const Outcome outcome = run("bad", "0-6", {"--denoise", "--denoise-frames", "1", "--fps", "1"});
    EXPECT_EQ(outcome.status, 1);
    EXPECT_NE(outcome.err.find("frame 3 (1 of 7) failed"), std::string::npos) << outcome.err;
    EXPECT_EQ(contents("bad").size(), 6u);
}

}  // namespace
}  // namespace halflight::test
