// Tests `halflight converge` on fake methods with known errors: order of runs, slopes, biases and findings.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "tests/unit/tools/converge_fakes.h"

namespace halflight::converge::test {
namespace {

TEST(ConvergePlan, RunsEveryPictureOnceInTurnsThatRotate) {
    const Plan plan{{Method::compute, Method::plain, Method::oracle}, {{1, 0}, {2, 0}, {4, 0}, {8, 0}}, 6};
    const std::vector<converge::Run> runs = runs_of(plan);
    std::set<std::array<int, 3>> seen;
    std::map<std::uint32_t, std::set<std::pair<int, int>>> users;
    for (const converge::Run& run : runs) {
        seen.insert({run.method, run.budget, run.repeat});
        users[run.seed].insert({run.budget, run.repeat});
    }
    EXPECT_EQ(runs.size(), 72u);
    EXPECT_EQ(seen.size(), 72u);
    EXPECT_EQ(users.size(), 24u);  // per budget and repeat, all methods share one seed
    for (const auto& [seed, user] : users) EXPECT_EQ(user.size(), 1u) << seed;

    std::map<int, int> firsts, first_budgets;
    for (std::size_t turn = 0; turn < runs.size(); turn += 3) {
        ++firsts[runs[turn].method];
        if (turn % 12 == 0) ++first_budgets[runs[turn].budget];
        for (std::size_t i = turn; i < turn + 3; ++i) {  // each method makes one picture per turn
            EXPECT_EQ(runs[i].seed, runs[turn].seed);
            EXPECT_EQ(runs[i].budget, runs[turn].budget);
        }
    }
    for (int method = 0; method < 3; ++method) EXPECT_EQ(firsts[method], 8);
    EXPECT_EQ(first_budgets.size(), 4u);
}

const Finding* find(const MethodResult& method, Finding::Kind kind) {
    const auto found = std::ranges::find(method.findings, kind, &Finding::kind);
    return found == method.findings.end() ? nullptr : &*found;
}

TEST(Converge, IndependentSamplesHaveSlopeMinusOne) {
    const Measurement measured = measure_fakes({}, {.sample_seconds = 4e-3});
    ASSERT_EQ(measured.methods.size(), 2u);
    ASSERT_EQ(measured.runs.size(), 64u);
    for (const MethodResult& method : measured.methods) {
        EXPECT_NEAR(method.slope.slope.value, -1, 0.05);
        EXPECT_LT(method.slope.slope.half_width, 0.1);
        EXPECT_TRUE(method.findings.empty()) << method.findings.front().text;
        for (std::size_t b = 0; b < kPlan.budgets.size(); ++b) {
            const Point& point = method.points[b];
            const double variance = 5 * 0.09 / kPlan.budgets[b].samples;  // variance of the sum of five components
            EXPECT_NEAR(point.variance.value, variance, 0.1 * variance);
            EXPECT_NEAR(point.mse.value, point.variance.value + point.bias_squared.value, 1e-9);
            EXPECT_LT(std::abs(point.bias_squared.value), 0.03 * variance);
            EXPECT_LT(std::abs(point.relative_bias.value), 3 * point.relative_bias.half_width);
            EXPECT_NEAR(point.components[2], variance / 5, 0.1 * variance);
            EXPECT_DOUBLE_EQ(point.time.cpu, 2 * point.time.wall);
        }
    }
    // The second method takes four times as long for the same error.
    EXPECT_NEAR(measured.methods[0].efficiency / measured.methods[1].efficiency, 4, 1e-6);
}

TEST(Converge, BiasIsFlagged) {
    const Measurement measured = measure_fakes({}, {.bias = 0.1f});
    EXPECT_FALSE(find(measured.methods[0], Finding::Kind::bias));
    const MethodResult& biased = measured.methods[1];
    EXPECT_TRUE(find(biased, Finding::Kind::bias));
    EXPECT_NEAR(biased.points.back().bias_squared.value, 0.01, 0.001);
    EXPECT_NEAR(biased.points.back().relative_bias.value, 0.1 / 1.5, 0.002);
    EXPECT_GT(biased.slope.slope.value, -0.9);
}

/// Another program whose model differs has eight times our squared error, of which its four times longer pictures and
/// equal noise explain a half: the rest is squared difference.
TEST(Converge, ProgramsThatDifferAreComparedByVariance) {
    Plan plan = kPlan;
    plan.methods[1] = Method::external, plan.external = {"Other", "render"};
    const auto factor = [](const Measurement& m, double MethodResult::*efficiency) {
        return m.methods[0].*efficiency / m.methods[1].*efficiency;
    };
    const Measurement same = measure_fakes({}, {.sample_seconds = 4e-3}, plan);
    EXPECT_FALSE(same.by_variance);
    EXPECT_NEAR(factor(same, &MethodResult::efficiency), 4, 1e-6);
    const Measurement other = measure_fakes({}, {.bias = 0.084f, .sample_seconds = 4e-3}, plan);
    EXPECT_TRUE(other.by_variance);
    EXPECT_GT(factor(other, &MethodResult::efficiency), 7.5);
    EXPECT_NEAR(factor(other, &MethodResult::efficiency_by_variance), 4, 0.01);
    EXPECT_FALSE(find(other.methods[1], Finding::Kind::bias));
    EXPECT_TRUE(find(other.methods[1], Finding::Kind::difference));
    EXPECT_EQ(other.methods[0].name, "Halflight (plain)");

    plan.clamp = 1;  // a bias on request is no difference between the programs
    plan.methods = {Method::plain, Method::oracle, Method::external};
    std::vector<std::unique_ptr<Painter>> painters;
    for (const float bias : {0.1f, 0.0f, 0.0f}) painters.push_back(std::make_unique<FakePainter>(Fake{.bias = bias}));
    const Measurement clamped = measure(plan, painters, fake_reference(4096), Clock::wall, {[] {}, [](double) {}});
    EXPECT_EQ(clamped.agreements[0].agreement.verdict(), Verdict::differ);
    EXPECT_FALSE(clamped.by_variance);
    EXPECT_TRUE(find(clamped.methods[0], Finding::Kind::bias));
}

TEST(Converge, UnexpectedSlopesAreExplained) {
    Plan fine = kPlan;
    fine.budgets = {{1, 0}, {2, 0}, {4, 0}, {8, 0}, {16, 0}, {32, 0}, {64, 0}};
    const Measurement slow = measure_fakes({.noise = 10, .decay = 0.3, .rare = 0.001}, {.decay = 0.8}, fine);
    EXPECT_TRUE(find(slow.methods[0], Finding::Kind::heavy_tails));
    EXPECT_GT(slow.methods[0].points.back().worst_share, 0.9);
    EXPECT_TRUE(find(slow.methods[1], Finding::Kind::faster));

    const Measurement fixed = measure_fakes({.fixed_seconds = 8e-3}, {.decay = 0.3});
    EXPECT_TRUE(find(fixed.methods[0], Finding::Kind::fixed_time));
    EXPECT_NEAR(fixed.methods[0].slope_by_samples.slope.value, -1, 0.05);
    EXPECT_TRUE(find(fixed.methods[1], Finding::Kind::unclear));

    const Plan few{{Method::plain, Method::oracle}, {{1, 0}, {2, 0}}, 2};
    EXPECT_TRUE(find(measure_fakes({.rare = 0.002}, {}, few).methods[0], Finding::Kind::inconclusive));
}

TEST(Converge, PicturesOfGlMethodsAreCompared) {
    Plan plan = kPlan;
    plan.methods = {Method::plain, Method::compute};
    const Measurement same = measure_fakes({}, {.sample_seconds = 2e-3}, plan);
    EXPECT_EQ(same.pictures_compared, 32);
    EXPECT_EQ(same.pictures_different, 0);
    for (std::size_t b = 0; b < plan.budgets.size(); ++b)
        EXPECT_EQ(same.methods[0].points[b].mse.value, same.methods[1].points[b].mse.value);
    EXPECT_EQ(measure_fakes({}, {.bias = 0.1f}, plan).pictures_different, 32);
    EXPECT_EQ(measure_fakes({}, {.bias = 0.1f}).pictures_compared, 0);  // the oracle's noise is independent
}

TEST(Converge, ShareOfTimeAndErrorByStage) {
    const Measurement measured = measure_fakes({}, {});
    const std::vector<Stage>& stages = measured.methods[0].stages;
    ASSERT_EQ(stages.size(), 3u);
    const double time[] = {1 / 8.0, 2 / 8.0, 5 / 8.0}, error[] = {1 / 5.0, 2 / 5.0, 2 / 5.0};
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(stages[i].time_share, time[i], 1e-9);
        EXPECT_NEAR(stages[i].error_share, error[i], 0.02);
        EXPECT_NEAR(stages[i].gain.value, 1 / ((1 - error[i] / 2) * (1 + time[i])), 0.02);
        EXPECT_GT(stages[i].gain.half_width, 0);
        EXPECT_LT(stages[i].gain.half_width, 0.05);
    }
    // The efficiency ratio is 1 / (0.8 * 1.25) for direct light and 1 / (0.9 * 1.125) for emission.
    EXPECT_NEAR(measured.methods[0].stage_lead.value, 1 / (0.8 * 1.25) - 1 / (0.9 * 1.125), 0.02);
    EXPECT_GT(measured.methods[0].stage_lead.half_width, 0);
    const char* const passes[] = {"gbuffer: resolve",
                                  "primary rays: closest hit",
                                  "accumulate",
                                  "shadow: sample lights",
                                  "diffuse: sample",
                                  "glossy rays: closest hit",
                                  "continuation: last vertex",
                                  "later shadow rays: any hit",
                                  "connection rays: any hit",
                                  "reuse: gather"};
    for (std::size_t i = 0; i < std::size(passes); ++i)
        EXPECT_EQ(stage_of(passes[i]), i < 3 ? 0u : i < 4 ? 1u : 2u) << passes[i];
}

TEST(Converge, TimeToTheSameErrorIsInterpolated) {
    MethodResult method;
    for (const double samples : {1.0, 4.0, 16.0}) {
        Point& point = method.points.emplace_back();
        point.time = {0.5 * samples, samples};
        point.mse.value = 1 / samples, point.off_edges_mse.value = 0.5 / samples;
    }
    EXPECT_DOUBLE_EQ(seconds_until(method, 1.0 / 8, Clock::wall), 4);  // halfway on a log-log plot
    EXPECT_DOUBLE_EQ(seconds_until(method, 1.0 / 8, Clock::cpu), 8);
    EXPECT_DOUBLE_EQ(seconds_until(method, 1.0 / 16, Clock::cpu, &Point::off_edges_mse), 8);
    EXPECT_DOUBLE_EQ(seconds_until(method, 1.0 / 16, Clock::cpu), 16);
    EXPECT_DOUBLE_EQ(seconds_until(method, 2, Clock::wall), 0.5) << "that of the first budget";
    EXPECT_EQ(seconds_until(method, 1.0 / 17, Clock::wall), std::numeric_limits<double>::infinity());
    method.points[2].mse.value = -1e-9;  // estimates of tiny errors may be negative
    EXPECT_DOUBLE_EQ(seconds_until(method, 0.01, Clock::cpu), 16);
}

TEST(Converge, TimeToTheSameErrorHasAnInterval) {
    MethodResult method;
    for (const double samples : {1.0, 4.0, 16.0, 64.0}) {
        Point& point = method.points.emplace_back();
        point.time = {samples, samples};
        point.mse = {1 / samples, 0.03 / samples};
    }
    // The error is inverse to the time, so both have the same relative interval: that of 3 % and 4 % together.
    const TimeToError time = time_to_error(method, {1.0 / 8, 0.04 / 8}, Clock::cpu);
    EXPECT_DOUBLE_EQ(time.seconds, 8);
    EXPECT_NEAR(time.lower, 8 * std::exp(-0.05), 1e-9);
    EXPECT_NEAR(time.upper, 8 * std::exp(0.05), 1e-9);
    const TimeToError last = time_to_error(method, {1.0 / 64, 0.1 / 64}, Clock::cpu);
    EXPECT_LT(last.lower, 64);
    EXPECT_EQ(last.upper, std::numeric_limits<double>::infinity()) << "the largest budget may be too small";
    for (Point& point : method.points) point.mse.half_width = std::numeric_limits<double>::infinity();
    const TimeToError unknown = time_to_error(method, {1.0 / 8, 0}, Clock::cpu);
    EXPECT_DOUBLE_EQ(unknown.seconds, 8);
    EXPECT_DOUBLE_EQ(unknown.lower, 1);
    EXPECT_EQ(unknown.upper, std::numeric_limits<double>::infinity());
}

TEST(Converge, EdgesOfLightsAreFoundInTheReferencesEmission) {
    Reference reference = fake_reference(2);
    Image& emission = reference.mean.components[0];
    emission = Image(kWidth, kHeight, 3);
    for (int y = 10; y < 20; ++y)
        for (int x = 10; x < 20; ++x) emission.at(x, y)[1] = 5;
    const Image weights = weights_off_edges(reference);
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            const bool near = x >= 9 && x <= 20 && y >= 9 && y <= 20;
            const bool inside = x >= 11 && x <= 18 && y >= 11 && y <= 18;
            for (int c = 0; c < 3; ++c) EXPECT_EQ(weights.at(x, y)[c], near && !inside ? 0 : 1) << x << ", " << y;
        }
    }
    reference.has_components = false;
    EXPECT_TRUE(weights_off_edges(reference).pixels.empty());
}

TEST(Converge, PicturesWithoutComponentsHaveNoShares) {
    struct Plain final : Painter {
        FakePainter fake{{}};
        Painted paint(const Budget& budget, std::uint32_t seed, const Pulse& pulse) override {
            Painted painted = fake.paint(budget, seed, pulse);
            painted.picture.components = {};
            return painted;
        }
        std::vector<PassTime> passes(const Budget&, std::uint32_t, const Pulse&) override { return {}; }
        Seconds preparation() const override { return {}; }
    };
    Plan plan = kPlan;
    plan.methods[1] = Method::external, plan.external = {"other", "render"};
    std::vector<std::unique_ptr<Painter>> painters;
    painters.push_back(std::make_unique<FakePainter>(Fake{}));
    painters.push_back(std::make_unique<Plain>());
    const Measurement measured = measure(plan, painters, fake_reference(4096), Clock::wall, {[] {}, [](double) {}});
    const Point &ours = measured.methods[0].points[0], &others = measured.methods[1].points[0];
    EXPECT_TRUE(ours.has_components);
    EXPECT_FALSE(others.has_components);
    EXPECT_EQ(ours.mse.value, others.mse.value) << "the same pictures";
    EXPECT_TRUE(measured.methods[1].stages.empty());
    EXPECT_EQ(measured.pictures_compared, 0) << "they need not be the same";
    EXPECT_NEAR(ours.paths_per_second.value, kWidth * kHeight / 1e-3, 1e-3);
    ASSERT_EQ(measured.agreements.size(), 1u);
    EXPECT_EQ(measured.agreements[0].agreement.blocks.size(), 2u) << "whole blocks of 16 x 16 pixels";
    EXPECT_EQ(measured.agreements[0].agreement.whole.relative, 0) << "the same pictures";
    EXPECT_EQ(measured.agreements[0].agreement.verdict(), Verdict::agree);
}

TEST(Converge, OneSeedHasNoIntervals) {
    Plan plan = kPlan;
    plan.seeds = 1;
    const MethodResult method = measure_fakes({}, {}, plan).methods[0];
    const Point& point = method.points[0];
    EXPECT_NEAR(point.mse.value, 0.45, 0.05);
    for (const Interval& unknown : {point.mse, point.bias_squared, point.paths_per_second, method.stage_lead})
        EXPECT_TRUE(std::isinf(unknown.half_width));
}

TEST(Converge, UndeterminedSlopesAreInfinite) {
    const auto first = [](Plan plan) { return measure_fakes({}, {}, plan).methods[0]; };
    const Plan one_budget{{Method::plain, Method::oracle}, {{4, 0}}, 8},
        two_pictures{one_budget.methods, {{1, 0}, {4, 0}}, 1}, two_budgets{one_budget.methods, {{1, 0}, {4, 0}}, 4};
    for (const Plan& plan : {one_budget, two_pictures}) {
        const MethodResult method = first(plan);
        EXPECT_EQ(text(method.slope), "none");
        ASSERT_EQ(method.findings.size(), 1u);
        EXPECT_EQ(method.findings[0].kind, Finding::Kind::inconclusive);
    }
    EXPECT_NE(text(first(two_budgets).slope), "none");
}

// Student's t over the seeds gives the interval of each MSE if there are two budgets. The logarithm propagates
// the relative half width.
TEST(Converge, FewSeedsWidenSlopes) {
    const Plan plan{{Method::plain, Method::oracle}, {{1, 0}, {4, 0}}, 2};
    const MethodResult method = measure_fakes({}, {}, plan).methods[0];
    const auto relative = [&](std::size_t b) { return method.points[b].mse.half_width / method.points[b].mse.value; };
    EXPECT_NEAR(method.slope.slope.half_width, std::hypot(relative(0), relative(1)) / std::log(4.0), 1e-9);
}

TEST(Converge, HeavyTailsUseAtLeastOnePixel) {
    MethodResult method;
    Point& point = method.points.emplace_back();
    point.mse = {1, 0.1};
    point.worst_share = 0.9;
    const auto has_tails = [&] {
        method.findings = findings_of(method);
        return find(method, Finding::Kind::heavy_tails) != nullptr;
    };
    method.picture = Image(10, 99, 3);
    EXPECT_FALSE(has_tails());
    method.picture = Image(10, 100, 3);
    EXPECT_TRUE(has_tails());
}

TEST(Converge, NoisyReferencesAreReported) {
    EXPECT_TRUE(find(measure_fakes({}, {}, kPlan, fake_reference(32)).methods[0], Finding::Kind::noisy_reference));
    EXPECT_FALSE(find(measure_fakes({}, {}, kPlan, fake_reference(128)).methods[0], Finding::Kind::noisy_reference));
}

TEST(Converge, StopsWhenThePulseThrows) {
    std::vector<std::unique_ptr<Painter>> painters;
    painters.push_back(std::make_unique<FakePainter>(Fake{}));
    const Plan plan{{Method::plain}, kPlan.budgets, kPlan.seeds};
    int pulses = 0;
    const Pulse pulse = [&] {
        if (++pulses == 5) throw std::runtime_error("stop");
    };
    EXPECT_THROW(measure(plan, painters, fake_reference(64), Clock::wall, {pulse, [](double) {}}), std::runtime_error);
    EXPECT_EQ(pulses, 5);
}

}  // namespace
}  // namespace halflight::converge::test
