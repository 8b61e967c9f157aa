#include <gtest/gtest.h>

#include "engine/rays/choice.h"

namespace halflight::rays {
namespace {

/// Runs the choice with fixed times by method; returns how often it selected each method.
std::vector<int> run(Choice& choice, std::vector<double> seconds, int runs) {
    std::vector<int> turns(seconds.size());
    for (int i = 0; i < runs; ++i) {
        ++turns[choice.now()];
        choice.ran(seconds[choice.now()]);
    }
    return turns;
}

TEST(Choice, NeedsNoTrialsWithOneMethod) {
    Choice choice({"plain"});
    EXPECT_FALSE(choice.on_trial());
    EXPECT_EQ(run(choice, {1}, 1000)[0], 1000);
    EXPECT_FALSE(choice.on_trial());
}

TEST(Choice, LeavesShortJobsAlone) {
    Choice choice({"plain", "tiles"});
    EXPECT_EQ(run(choice, {2, 1}, Choice::kFirstRuns), (std::vector<int>{Choice::kFirstRuns, 0}));
    EXPECT_EQ(choice.now(), 1u);
    EXPECT_TRUE(choice.on_trial());
}

TEST(Choice, WaitsUntilATrialCanPay) {
    constexpr std::uint64_t kFirst = 64;
    Choice choice({"native", "tiles"}, kFirst);
    EXPECT_EQ(choice.reason(), "native serves the first 64 runs");
    run(choice, {2, 1}, kFirst - Choice::kFirstRuns - 1);
    EXPECT_FALSE(choice.on_trial());
    run(choice, {2, 1}, 1);
    EXPECT_TRUE(choice.on_trial()) << "the last of them are timed";
    EXPECT_EQ(choice.now(), 0u);
    run(choice, {2, 1}, Choice::kFirstRuns);
    EXPECT_EQ(choice.now(), 1u);
    run(choice, {2, 1}, Choice::kTrials);
    EXPECT_EQ(choice.reason(), "2.00 times as fast as native (fastest runs: 1000.0 ms, 2000.0 ms)");
}

TEST(Choice, SettlesOnTheFasterMethodAndGivesTheReason) {
    for (const bool tiles : {false, true}) {
        Choice choice({"plain", "tiles"});
        run(choice, {tiles ? 0.002 : 0.001, tiles ? 0.001 : 0.002}, Choice::kFirstRuns + Choice::kTrials);
        EXPECT_EQ(choice.now(), tiles ? 1u : 0u);
        EXPECT_FALSE(choice.on_trial());
        EXPECT_EQ(choice.reason(), tiles ? "2.00 times as fast as plain (fastest runs: 1.0 ms, 2.0 ms)"
                                         : "2.00 times as fast as tiles (fastest runs: 1.0 ms, 2.0 ms)");
    }
}

TEST(Choice, IgnoresTheRunThatCompiles) {
    Choice choice({"plain", "tiles"});
    run(choice, {2, 0}, Choice::kFirstRuns);
    for (const double seconds : {50.0, 3.0, 1.0}) choice.ran(seconds);
    EXPECT_EQ(choice.now(), 1u);
}

TEST(Choice, FollowsWorkThatChanges) {
    Choice choice({"plain", "tiles"});
    run(choice, {1, 1.2}, Choice::kFirstRuns + Choice::kTrials);
    EXPECT_EQ(choice.now(), 0u);
    run(choice, {2, 1}, Choice::kReexamine + Choice::kTrials + 1);  // plain was faster only at first
    EXPECT_EQ(choice.now(), 1u);
    EXPECT_FALSE(choice.on_trial());
}

TEST(Choice, SpendsLittleOnASlowMethod) {
    const double slow = 1.5;
    Choice choice({"plain", "tiles"});
    run(choice, {1, slow}, Choice::kFirstRuns + Choice::kTrials);
    const int runs = 10000;
    const std::vector<int> turns = run(choice, {1, slow}, runs);
    EXPECT_GT(turns[1], 0);
    EXPECT_LT(turns[1] * (slow - 1) / runs, 0.01);
}

TEST(Choice, ResetStartsFromTheBeginning) {
    Choice choice({"plain", "tiles"});
    run(choice, {2, 1}, 500);
    choice.forget();
    EXPECT_EQ(choice.now(), 0u);
    EXPECT_EQ(choice.reason(), "undecided: plain on trial");
    EXPECT_EQ(run(choice, {2, 1}, Choice::kFirstRuns)[0], Choice::kFirstRuns);
}

}  // namespace
}  // namespace halflight::rays
