// Tests what is left when the driver loses its context.
#include <algorithm>
#include <set>

#include "tests/cli/sequence_test.h"

namespace halflight::test {
namespace {

class LostDevice : public Sequence {
  protected:
    /// Renders frames 1 to 3 with a context that is lost after so many checks.
    Outcome lose_after(int checks, const std::string& into, const Strings& more = {}) {
        return run(
            into, "1-3", more,
            {.environment = {"LD_PRELOAD=" HALFLIGHT_LOST_DEVICE, "HALFLIGHT_LOSE_AFTER=" + std::to_string(checks)}});
    }
    static constexpr const char* kLost =
        "the driver has reset the GPU, whose context is lost; what was not finished is missing\n";
};

TEST_F(LostDevice, FinishedFramesStayWhole) {
    make("whole", "1-3");
    const auto whole = contents("whole");
    ASSERT_EQ(lose_after(1'000'000, "never").status, 0);
    EXPECT_EQ(contents("never"), whole) << "the library changes nothing else";
    std::set<std::size_t> numbers;  // numbers of finished frames
    for (const int checks : {0, 3, 30, 50, 70}) {
        const std::string into = "out" + std::to_string(checks);
        const Outcome outcome = lose_after(checks, into, {"--quiet"});
        EXPECT_EQ(outcome.status, 1) << checks;
        EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
        EXPECT_TRUE(outcome.err.ends_with(kLost)) << outcome.err;
        const auto left = fs::exists(folder / into) ? contents(into) : std::map<std::string, std::string>();
        numbers.insert(left.size());
        for (const auto& [name, bytes] : left) EXPECT_EQ(bytes, whole.at(name)) << checks << " " << name;
        EXPECT_LT(left.size(), whole.size());
        EXPECT_EQ(make(into, "1-3").status, 0);
        EXPECT_EQ(contents(into), whole) << "another run completes the sequence";
    }
    EXPECT_GE(numbers.size(), 2u) << "the context was never lost between two frames";
}

TEST_F(LostDevice, APictureIsNotWritten) {
    const Outcome outcome =
        run_program({"render", scene, folder / "one.exr", "--width", "16", "--height", "16", "--samples", "4"},
                    {.environment = {"LD_PRELOAD=" HALFLIGHT_LOST_DEVICE, "HALFLIGHT_LOSE_AFTER=3"}});
    EXPECT_EQ(outcome.status, 1);
    EXPECT_TRUE(outcome.err.ends_with(kLost)) << outcome.err;
    EXPECT_FALSE(fs::exists(folder / "one.exr"));
}

/// A checkpoint never holds what a lost context reads: the next run makes the same picture.
TEST_F(LostDevice, CheckpointsHoldNoLostSamples) {
    const auto render = [&](const std::string& name, int checks) {
        Strings arguments = {"render", scene, folder / name, "--width", "16", "--height", "16", "--samples", "3"};
        arguments.insert(arguments.end(), {"--reproducible", "--checkpoint", "0.001"});
        RunOptions options;
        if (checks >= 0)
            options.environment = {"LD_PRELOAD=" HALFLIGHT_LOST_DEVICE,
                                   "HALFLIGHT_LOSE_AFTER=" + std::to_string(checks)};
        return run_program(arguments, options);
    };
    ASSERT_EQ(render("whole.exr", -1).status, 0);
    const std::string whole = read_text(folder / "whole.exr");
    int lost = 0;
    for (int checks = 1;; checks += 4) {
        const Outcome outcome = render("lost.exr", checks);
        if (outcome.status == 0) break;
        ++lost;
        EXPECT_TRUE(outcome.err.ends_with(kLost)) << outcome.err;
        ASSERT_FALSE(fs::exists(folder / "lost.exr"));
        ASSERT_EQ(render("lost.exr", -1).status, 0) << checks;
        EXPECT_TRUE(read_text(folder / "lost.exr") == whole) << checks;
        fs::remove(folder / "lost.exr");
        fs::remove_all(folder / "lost.exr.checkpoint");
    }
    EXPECT_GE(lost, 5);
}

/// Pieces of dispatches change no bit.
TEST_F(LostDevice, SplitDispatchesGiveTheSameFrames) {
    const Strings options{"--estimator", "reuse=4", "--culling", "compute", "--bounces", "1"};
    make("whole", "1", options);
    make("split", "1", options, {.environment = {"HALFLIGHT_DISPATCH_MS=0.05"}});
    EXPECT_EQ(contents("split"), contents("whole"));
    EXPECT_EQ(run("none", "1", {}, {.environment = {"HALFLIGHT_DISPATCH_MS=soon"}}).status, 1);
}

}  // namespace
}  // namespace halflight::test
