// Tests the error estimate of a mean of replicates on pictures whose true value is 0.
#include "engine/core/replicates.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "engine/core/statistics.h"
#include "renderer/replicates.h"

namespace halflight {
namespace {

using Picture = std::vector<double>;

struct Outcome {
    ErrorEstimate estimate;
    double truth = 0;  // true squared error of the mean
};

Outcome look(const std::vector<Picture>& replicates) {
    ReplicateError error(static_cast<int>(replicates.size()));
    Outcome outcome;
    std::vector<double> values(replicates.size());
    for (std::size_t i = 0; i < replicates[0].size(); ++i) {
        double mean = 0;
        for (std::size_t r = 0; r < replicates.size(); ++r) mean += values[r] = replicates[r][i];
        error.add(values, 1);
        outcome.truth +=
            std::pow(mean / static_cast<double>(replicates.size()), 2) / static_cast<double>(replicates[0].size());
    }
    outcome.estimate = error.estimate();
    return outcome;
}

TEST(ReplicateError, IsTheVarianceOfTheMean) {
    const Outcome o = look({{1, 0}, {-1, 0}, {2, 0}, {-2, 0}});
    // The value is a quarter of the sample variance 10 / 3, averaged over two values.
    EXPECT_DOUBLE_EQ(o.estimate.value, 10.0 / 3 / 4 / 2);
    const Outcome same = look({{1}, {1}, {1}, {1}});
    EXPECT_EQ(same.estimate.value, 0);
    EXPECT_EQ(same.estimate.bound, 0);
}

TEST(ReplicateError, WeightsAndPartsAddUp) {
    const std::vector<double> a{1, 2, 4, 8, 3}, b{0, 1, 0, 2, 9};
    ReplicateError whole(5), first(5), second(5), alone(5);
    whole.add(a, 2), whole.add(b, 0.5);
    first.add(a, 2), second.add(b, 0.5), alone.add(a, 1);
    const double value = first.estimate().value;
    EXPECT_DOUBLE_EQ(value, 2 * alone.estimate().value);
    first.add(second);
    EXPECT_DOUBLE_EQ(first.estimate().value, whole.estimate().value);
    EXPECT_DOUBLE_EQ(first.estimate().bound, whole.estimate().bound);
    EXPECT_DOUBLE_EQ(whole.estimate().value, (value + second.estimate().value) / 2);  // mean of the two values
}

void expect_coverage(const char* what, const std::function<Picture(std::mt19937&)>& render) {
    constexpr int kTrials = 1000, kReplicates = 8;
    std::mt19937 random(1);
    int inside = 0, below = 0;
    RunningMoments excess;
    for (int trial = 0; trial < kTrials; ++trial) {
        std::vector<Picture> replicates;
        for (int r = 0; r < kReplicates; ++r) replicates.push_back(render(random));
        const auto [e, truth] = look(replicates);
        inside += e.lower <= truth && truth <= e.upper;
        below += truth <= e.bound;
        excess.add(e.value - truth);
    }
    EXPECT_NEAR(excess.mean(), 0, 4 * excess.standard_error()) << what;
    // The bound is 95 % minus 2.1 %, three standard errors of a share of 1000, minus 1 % because products are not quite
    // normal.
    EXPECT_GE(inside, 0.92 * kTrials) << what;
    EXPECT_GE(below, 0.92 * kTrials) << what;
    EXPECT_LE(inside, 0.985 * kTrials) << what;
    EXPECT_LE(below, 0.985 * kTrials) << what;
}

constexpr std::size_t kValues = 400;

TEST(ReplicateError, HoldsForGaussianPixels) {
    std::normal_distribution<double> normal;
    expect_coverage("independent", [&](std::mt19937& random) {
        Picture picture(kValues);
        for (double& v : picture) v = normal(random);
        return picture;
    });
}

TEST(ReplicateError, HoldsForCorrelatedNeighbours) {
    std::normal_distribution<double> normal;
    expect_coverage("blocks of 20", [&](std::mt19937& random) {
        Picture picture(kValues);
        double shared = 0;
        for (std::size_t i = 0; i < picture.size(); ++i) {
            if (i % 20 == 0) shared = normal(random);
            picture[i] = shared + 0.5 * normal(random);
        }
        return picture;
    });
}

TEST(ReplicateError, HoldsForRareBrightPixels) {
    expect_coverage("one in 16", [&](std::mt19937& random) {
        Picture picture(kValues);
        for (double& v : picture) v = (random() % 16 == 0 ? 15 : -1) / std::sqrt(15.0);
        return picture;
    });
}

/// A picture that ends once its bound meets a target: few values, of which five have rare hits and half of the error.
TEST(PictureError, HoldsWhereSamplingEnds) {
    constexpr int kTrials = 400, kRare = 5;
    constexpr double kTarget = 0.01, kChance = 0.02;
    std::mt19937 random(1);
    std::normal_distribution<double> noise(0, std::sqrt(0.5));
    const double height = std::sqrt(0.5 * kValues / kRare / (kChance * (1 - kChance)));
    int inside = 0, below = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
        std::vector<Picture> sums(kReplicates, Picture(kValues));
        int each = 0, chances = 0;
        ErrorEstimate e;
        std::vector<double> values(kReplicates);
        double truth = 0;
        for (int next = kFirstLook; each == 0 || e.bound > kTarget; next = next_replicate_samples(each, e, kTarget)) {
            const int more = next - each;
            std::binomial_distribution hits(more, kChance);
            for (Picture& sum : sums)
                for (std::size_t i = 0; i < kValues; ++i)
                    sum[i] += i < kRare ? height * (hits(random) - more * kChance) : std::sqrt(more) * noise(random);
            each = next;
            PictureError error;
            truth = 0;
            for (std::size_t i = 0; i < kValues; ++i) {
                double mean = 0;
                for (std::size_t r = 0; r < values.size(); ++r) mean += (values[r] = sums[r][i] / each) / kReplicates;
                error.add(values, ErrorMetric::mse);
                truth += mean * mean / kValues;
            }
            e = error.judge(kTarget, chances);
        }
        inside += e.lower <= truth && truth <= e.upper;
        below += truth <= e.bound;
    }
    // 95 % minus a standard error and a half. Without the chances, both are 92 %.
    EXPECT_GE(inside, 0.935 * kTrials);
    EXPECT_GE(below, 0.935 * kTrials);
}

}  // namespace
}  // namespace halflight
