// Tests the traversal of raster culling alone, and the choice between methods by their times. The traversal traces
// every visible leaf, with any visibility state and with late answers, and hidden nodes cost few queries.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "engine/rays/choice.h"
#include "engine/rays/raster_walk.h"
#include "shaders/shared/raster_lists.h"

namespace halflight::rays {
namespace {

/// Returns a tree of nodes with four children and `levels` levels below the root; its leaves lie along a line.
CullTree tree_of(int levels) {
    CullTree tree;
    tree.nodes.emplace_back();
    std::size_t first = 0;
    for (int level = 0; level < levels; ++level) {
        const std::size_t end = tree.nodes.size();
        for (std::size_t n = first; n < end; ++n) {
            tree.nodes[n].first_child = static_cast<std::uint32_t>(tree.nodes.size());
            tree.nodes[n].child_count = 4;
            for (int c = 0; c < 4; ++c) {
                tree.nodes.emplace_back();
                tree.nodes.back().parent = static_cast<std::uint32_t>(n);
            }
        }
        first = end;
    }
    for (std::size_t n = first; n < tree.nodes.size(); ++n) {
        const auto x = static_cast<float>(n - first);
        tree.nodes[n].box = {vec3(x, 0, 0), vec3(x + 1, 1, 1)};
    }
    for (std::size_t n = tree.nodes.size(); n-- > 1;) tree.nodes[tree.nodes[n].parent].box.add(tree.nodes[n].box);
    tree.hull = tree.nodes[0].box;
    return tree;
}

/// Answers queries from a set of visible leaves; some answers are late, and some wrongly say "visible".
class FakeDevice : public CullDevice {
  public:
    FakeDevice(const CullTree& tree, const std::vector<bool>& visible, double overcount)
        : tree_(tree), visible_(visible), overcount_(overcount), traced(tree.nodes.size()) {
        for (std::size_t n = tree.nodes.size(); n-- > 1;) {
            if (visible_[n]) visible_[tree.nodes[n].parent] = true;
        }
    }

    void trace(std::span<const std::uint32_t> leaves) override {
        EXPECT_GE(leaves.size(), 1u);
        EXPECT_LE(leaves.size(), std::size_t{shared::kRasterCandidates});
        for (const std::uint32_t leaf : leaves) {
            EXPECT_EQ(tree_.nodes[leaf].child_count, 0u);
            ++traced[leaf];
        }
    }

    void ask(std::span<const std::uint32_t> nodes) override {
        EXPECT_GE(nodes.size(), 1u);
        EXPECT_LE(nodes.size(), std::size_t{shared::kRasterCandidates});
        const bool any = std::any_of(nodes.begin(), nodes.end(), [&](std::uint32_t n) { return visible_[n]; });
        answers_.push_back(any || std::bernoulli_distribution(overcount_)(random_));
    }

    std::optional<bool> answer(std::size_t question, bool wait) override {
        if (!wait && random_() % 3 != 0) return std::nullopt;
        return answers_.at(question);
    }

  private:
    const CullTree& tree_;
    std::vector<bool> visible_;
    double overcount_;
    std::vector<bool> answers_;
    std::mt19937 random_{1};

  public:
    std::vector<int> traced;  // number of traces per node
};

std::vector<bool> some_leaves(const CullTree& tree, double share, std::uint32_t seed) {
    std::mt19937 random(seed);
    std::vector<bool> visible;
    for (const CullNode& n : tree.nodes)
        visible.push_back(n.child_count == 0 && std::bernoulli_distribution(share)(random));
    return visible;
}

TEST(RasterWalk, VisibleLeavesAreTracedOnce) {
    const CullTree tree = tree_of(4);
    std::mt19937 random(2);
    CullState state;
    RasterStatistics statistics;
    for (std::uint32_t run = 0; run < 60; ++run) {
        if (run % 10 == 9) {  // random visibility state
            for (CullMemory& m : state.nodes)
                m = {static_cast<std::uint32_t>(random()), static_cast<std::uint32_t>(random()), run % 20 ? 1u : 77u};
        }
        const std::vector<bool> visible = some_leaves(tree, 0.1 * (run % 11), run / 3);
        FakeDevice device(tree, visible, run % 4 == 3 ? 0.5 : 0);
        walk(tree, state, device, statistics);
        for (std::size_t n = 0; n < tree.nodes.size(); ++n) {
            EXPECT_LE(device.traced[n], 1);
            if (visible[n]) {
                EXPECT_EQ(device.traced[n], 1) << "run " << run << ", node " << n;
            }
        }
    }
    EXPECT_EQ(statistics.runs, 60u);

    const CullTree nothing;
    CullState empty;
    FakeDevice device(nothing, {}, 0);
    RasterStatistics none;
    walk(nothing, empty, device, none);
    EXPECT_EQ(none.queries + none.traces, 0u);
}

TEST(RasterWalk, AnUnchangedSceneCostsFewQueries) {
    const CullTree tree = tree_of(5);
    const std::vector<bool> visible = some_leaves(tree, 0.3, 3);
    const auto leaves = static_cast<std::size_t>(std::count(visible.begin(), visible.end(), true));
    CullState state;
    RasterStatistics warm, steady;
    for (int run = 0; run < 40; ++run) {
        FakeDevice device(tree, visible, 0);
        walk(tree, state, device, run < 20 ? warm : steady);
    }
    EXPECT_EQ(steady.leaves, 20 * leaves);             // hidden leaves are not traced
    EXPECT_LT(steady.queries, steady.nodes / 4);       // hidden nodes are queried in groups
    EXPECT_GT(steady.saved_visible, 20 * leaves / 2);  // visible nodes are re-tested rarely
    EXPECT_GT(steady.queries, steady.multi_queries);   // visible nodes are re-tested at all
}

/// Runs the choice with fixed times by method; returns how often it selected each method.
std::vector<int> run(Choice& choice, std::vector<double> seconds, int runs) {
    std::vector<int> turns(seconds.size());
    for (int i = 0; i < runs; ++i) {
        ++turns[choice.now()];
        choice.ran(seconds[choice.now()]);
    }
    return turns;
}

TEST(Choice, LeavesShortJobsAlone) {
    Choice one({"plain"});
    EXPECT_FALSE(one.on_trial());
    EXPECT_EQ(run(one, {1}, 1000)[0], 1000);
    EXPECT_FALSE(one.on_trial());
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
        EXPECT_TRUE(choice.reason().starts_with(tiles ? "2.00 times as fast as plain" : "2.00 times as fast as tiles"));
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
