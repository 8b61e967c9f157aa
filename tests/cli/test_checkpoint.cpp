// Tests checkpoints of single pictures: halflight render --checkpoint.
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <optional>
#include <thread>

#include "tests/cli/output_test.h"

namespace halflight::test {
namespace {

class CheckpointOption : public Output {
  protected:
    /// Returns arguments of 60 samples that are saved all the time.
    Strings arguments(const std::string& output, Strings more = {}) const {
        Strings all = {"render", scene,       output,  "--width",        "48",           "--height", "48", "--samples",
                       "60",     "--denoise", "--aov", "variance,noisy", "--checkpoint", "0.02"};
        all.insert(all.end(), more.begin(), more.end());
        return all;
    }
    /// Runs the program and ends it by a signal, and by another one 5 ms later, once the checkpoint has a file.
    Outcome stop(const Strings& command, int signal, std::optional<int> another = {}) const {
        bool sent = false;
        RunOptions options;
        options.terminal = true;  // the progress bar gives something to watch
        options.watch = [&](pid_t child, const std::string&) {
            if (sent || !std::filesystem::exists(saved)) return;
            sent = kill(child, signal) == 0;
            if (!another) return;
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
            kill(child, *another);
        };
        return run_program(command, options);
    }

    const std::filesystem::path checkpoint = file("a.exr.checkpoint");
    const std::filesystem::path saved = checkpoint / "rows-00000.sums";
};

TEST_F(CheckpointOption, InterruptedPicturesGoOnToTheSameBits) {
    const Outcome whole = run_program(arguments(file("whole.exr")));
    ASSERT_EQ(whole.status, 0) << whole.err;
    EXPECT_FALSE(std::filesystem::exists(file("whole.exr.checkpoint")));
    for (const int signal : {SIGTERM, SIGKILL, SIGINT}) {
        const Outcome stopped = stop(arguments(file("a.exr")), signal);
        EXPECT_EQ(stopped.status, 128 + signal) << stopped.err;
        EXPECT_FALSE(std::filesystem::exists(file("a.exr")));
        EXPECT_TRUE(std::filesystem::exists(saved));
        const bool told =
            stopped.err.find("per pixel; the same command goes on from its checkpoint of ") != std::string::npos;
        EXPECT_EQ(told, signal != SIGKILL) << stopped.err;
    }
    const Outcome rest = run_program(arguments(file("a.exr")));
    EXPECT_EQ(rest.status, 0) << rest.err;
    EXPECT_NE(rest.err.find("goes on after"), std::string::npos) << rest.err;
    EXPECT_TRUE(same_pixels(file("whole.exr"), file("a.exr")));
    EXPECT_FALSE(std::filesystem::exists(checkpoint));
}

TEST_F(CheckpointOption, TwoSignalsAtOnceAreOneRequest) {
    const Outcome stopped = stop(arguments(file("a.exr")), SIGTERM, SIGHUP);  // timeout(1) sends its signal twice
    EXPECT_EQ(stopped.status, 128 + SIGTERM) << stopped.err;
    EXPECT_NE(stopped.err.find("; the same command goes on from its checkpoint of "), std::string::npos) << stopped.err;
}

TEST_F(CheckpointOption, LimitsOfCpuSecondsKeepTheSamples) {
    const Outcome stopped = stop(arguments(file("a.exr")), SIGXCPU);
    EXPECT_EQ(stopped.status, 128 + SIGXCPU) << stopped.err;
    EXPECT_NE(stopped.err.find("; the same command goes on from its checkpoint of "), std::string::npos) << stopped.err;
}

TEST_F(CheckpointOption, NoSamplesAreNoCheckpoint) {
    bool sent = false;
    RunOptions options;
    options.watch = [&](pid_t child, const std::string& err) {
        if (!sent && err.find("compiling shaders") != std::string::npos) sent = kill(child, SIGTERM) == 0;
    };
    const Outcome stopped =
        run_program(arguments(file("a.exr"), {"--no-shader-cache", "--quiet", "--progress", "json"}), options);
    EXPECT_EQ(stopped.status, 128 + SIGTERM) << stopped.err;
    EXPECT_NE(stopped.err.find("a.exr: not written: interrupted after 0 samples per pixel\n"), std::string::npos)
        << stopped.err;
    EXPECT_FALSE(std::filesystem::exists(checkpoint));
}

TEST_F(CheckpointOption, MergedPartsMayHaveOtherOutputsAndColour) {
    const auto run = [&](Strings more) {
        Strings all = {more[0], scene, "--width", "16", "--height", "16", "--samples", "4"};
        all.insert(all.end(), more.begin() + 1, more.end());
        return run_program(all);
    };
    for (const char* part : {"1/2", "2/2"}) EXPECT_EQ(run({"render", file("a.exr"), "--part", part}).status, 0);
    const Strings merge = {"merge", file("m.png"), file("a.exr"), "--sample-parts", "2", "--exposure", "1"};
    const Outcome merged = run(merge);
    EXPECT_EQ(merged.status, 0) << merged.err;
    EXPECT_EQ(run({"render", file("whole.exr"), "--sample-parts", "2"}).status, 0);
    EXPECT_TRUE(same_pixels(file("whole.exr"), file("a.exr")));
    Strings other = merge;
    other.insert(other.end(), {"--bounces", "1"});
    EXPECT_EQ(run(other).err,
              "halflight: " + file("a.exr.parts/1-of-2") +
                  ": was made with other settings or from another scene; render --part with the settings "
                  "of this merge and --overwrite makes it anew\n");
    EXPECT_TRUE(std::filesystem::exists(file("a.exr.parts/1-of-2/rows-00000.sums")));
}

TEST_F(CheckpointOption, MergeNeedsANumberOfParts) {
    EXPECT_EQ(run_program({"merge", scene}).err, "halflight: OUTPUT: is missing; see halflight merge --help\n");
    EXPECT_EQ(run_program({"merge", scene, file("a.exr"), "--samples", "4"}).err,
              "halflight: --sample-parts: is missing; it is the N of --part I/N\n");
    EXPECT_EQ(run_program({"merge", scene, file("a.exr"), "--sample-parts", "1"}).err,
              "halflight: --sample-parts: one part needs no merge; --part 1/1 renders the whole picture\n");
}

TEST_F(CheckpointOption, OtherPicturesAreRefused) {
    stop(arguments(file("a.exr")), SIGTERM);
    const Outcome other = run_program(arguments(file("a.exr"), {"--seed", "3"}));
    EXPECT_EQ(other.status, 1);
    EXPECT_EQ(other.err, "halflight: " + checkpoint.string() +
                             ": was made with other settings or from another scene; --overwrite begins the picture "
                             "anew\n");
    EXPECT_TRUE(std::filesystem::exists(saved));
    const Outcome anew = run_program(arguments(file("a.exr"), {"--seed", "3", "--overwrite"}));
    EXPECT_EQ(anew.status, 0) << anew.err;
    EXPECT_EQ(anew.err.find("goes on after"), std::string::npos) << anew.err;
    const Outcome plain = run_program(arguments(file("b.exr"), {"--seed", "3"}));
    EXPECT_TRUE(same_pixels(file("a.exr"), file("b.exr")));
}

TEST_F(CheckpointOption, FullDisksEndNoPicture) {
    // The sums of a band take 700 kB, the picture 60 kB.
    const RunOptions limited{.environment = {"HALFLIGHT_SHADER_SOURCES"}, .wrapper = {"prlimit", "--fsize=300000"}};
    const Outcome outcome = run_program(arguments(file("a.exr")), limited);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.err.find("warning: checkpoint not saved: " + saved.string()), std::string::npos) << outcome.err;
    EXPECT_TRUE(std::filesystem::exists(file("a.exr")));
    EXPECT_FALSE(std::filesystem::exists(checkpoint));
    const Outcome part = run_program(arguments(file("p.exr"), {"--part", "1/2", "--quiet"}), limited);
    EXPECT_EQ(part.status, 1);
    EXPECT_TRUE(part.err.starts_with("halflight: " + file("p.exr.parts/1-of-2/rows-00000.sums") + ": cannot write"))
        << part.err;
    EXPECT_EQ(std::ranges::count(part.err, '\n'), 1) << part.err;
}

TEST_F(CheckpointOption, OptionsThatKeepNoneAreRefused) {
    for (const Strings& more : {Strings{"--error", "0.01"}, {"--adaptive"}, {"--denoise-frames", "1"}}) {
        const Outcome outcome = run_program(arguments(file("a.exr"), more));
        EXPECT_EQ(outcome.status, 2);
        EXPECT_NE(outcome.err.find("--checkpoint"), std::string::npos) << outcome.err;
    }
    const Outcome part = run_program({"render", scene, file("a.exr"), "--part", "1/2", "--stats", file("s.json")});
    EXPECT_EQ(part.status, 2);
    EXPECT_NE(part.err.find("--part: cannot be given together with --stats"), std::string::npos) << part.err;
    const Outcome alone = run_program({"render", scene, file("a.exr"), "--overwrite"});
    EXPECT_EQ(alone.err, "halflight: --overwrite: needs --frames, --checkpoint or --part\n");
}

}  // namespace
}  // namespace halflight::test
