// Tests what is left when the driver loses its context.
#include <set>

#include "tests/cli/sequence_test.h"

namespace halflight::test {
namespace {

class LostDevice : public Sequence {
  protected:
    /// Lets the context be lost after so many checks.
    static RunOptions lost_after(int checks) {
        return {.environment = {"LD_PRELOAD=" HALFLIGHT_LOST_DEVICE, "HALFLIGHT_LOSE_AFTER=" + std::to_string(checks)}};
    }
    static void expect_lost(const Outcome& outcome) {
        EXPECT_EQ(outcome.status, 1);
        expect_has(outcome.err, "the driver has reset the GPU");
    }
};

TEST_F(LostDevice, FinishedFramesStayWhole) {
    make("whole", "1-3");
    const auto whole = contents("whole");
    make("never", "1-3", {}, lost_after(1'000'000));
    EXPECT_EQ(contents("never"), whole) << "the library changes nothing else";
    std::set<std::size_t> numbers;  // numbers of finished frames
    for (int checks = 0;;
         checks = 2 * checks + 3) {  // some number of checks ends a run of three frames after the first
        const std::string into = "out" + std::to_string(checks);
        const Outcome outcome = run(into, "1-3", {"--quiet"}, lost_after(checks));
        if (outcome.status == 0) break;
        expect_lost(outcome);
        EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
        const auto left = fs::exists(folder / into) ? contents(into) : std::map<std::string, std::string>();
        numbers.insert(left.size());
        for (const auto& [name, bytes] : left) EXPECT_EQ(bytes, whole.at(name)) << checks << " " << name;
        EXPECT_LT(left.size(), whole.size());
        make(into, "1-3");
        EXPECT_EQ(contents(into), whole) << "another run completes the sequence";
    }
    EXPECT_GE(numbers.size(), 2u) << "the context was never lost between two frames";
}

/// No picture is written, and a checkpoint never holds what a lost context reads: the next run makes the same picture.
TEST_F(LostDevice, CheckpointsHoldNoLostSamples) {
    const auto render = [&](const std::string& name, const RunOptions& options) {
        return run_program(words("render", scene, file(name), "--width 16 --height 16 --samples 3 --reproducible",
                                 "--checkpoint 0.001"),
                           options);
    };
    ASSERT_EQ(render("whole.exr", {}).status, 0);
    const std::string whole = read_text(file("whole.exr"));
    int lost = 0;
    for (int checks = 1;; checks += 4) {
        const Outcome outcome = render("lost.exr", lost_after(checks));
        if (outcome.status == 0) break;
        ++lost;
        expect_lost(outcome);
        ASSERT_FALSE(fs::exists(folder / "lost.exr"));
        ASSERT_EQ(render("lost.exr", {}).status, 0) << checks;
        EXPECT_TRUE(read_text(folder / "lost.exr") == whole) << checks;
        fs::remove(folder / "lost.exr");
        fs::remove_all(folder / "lost.exr.checkpoint");
    }
    EXPECT_GE(lost, 5);
}

/// Pieces of dispatches change no bit.
TEST_F(LostDevice, SplitDispatchesGiveTheSameFrames) {
    const Strings options = words("--estimator reuse=4 --culling compute --bounces 1");
    make("whole", "1", options);
    make("split", "1", options, {.environment = {"HALFLIGHT_DISPATCH_MS=0.05"}});
    EXPECT_EQ(contents("split"), contents("whole"));
    EXPECT_EQ(run("none", "1", {}, {.environment = {"HALFLIGHT_DISPATCH_MS=soon"}}).status, 1);
}

}  // namespace
}  // namespace halflight::test
