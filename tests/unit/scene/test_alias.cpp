// Tests which entries alias tables select, and how often.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

#include "engine/tables/alias_table.h"

namespace halflight {
namespace {

void expect_exact(const std::vector<double>& weights) {
    const AliasTable table = build_alias_table(weights);
    ASSERT_EQ(table.entries.size(), weights.size());
    const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
    const auto count = static_cast<double>(weights.size());
    double total = 0;
    std::vector<double> picked(weights.size(), 0);
    for (const AliasEntry& entry : table.entries) {
        ASSERT_LT(entry.alias, weights.size());
        EXPECT_EQ(entry.threshold, std::round(entry.threshold * 0x1p24) * 0x1p-24);
        const auto i = static_cast<std::size_t>(&entry - table.entries.data());
        picked[i] += entry.threshold / count;
        picked[entry.alias] += (1 - double(entry.threshold)) / count;
    }
    for (std::size_t i = 0; i < weights.size(); ++i) {
        total += table.probabilities[i];
        EXPECT_DOUBLE_EQ(table.probabilities[i], picked[i]) << i;
        EXPECT_EQ(table.probabilities[i] > 0, weights[i] > 0) << i;
        // The tolerance is a step of 2^-24 of a column, for the entry itself and for each column that it fills up.
        EXPECT_NEAR(table.probabilities[i], weights[i] / sum, 0x1p-23 * (1 / count + weights[i] / sum)) << i;
    }
    EXPECT_NEAR(total, 1, 1e-12);
}

TEST(AliasTable, SingleEntry) {
    expect_exact({3.5});
}
TEST(AliasTable, EqualEntries) {
    expect_exact(std::vector<double>(37, 0.1));
}
TEST(AliasTable, ZeroWeightsAreNeverSelected) {
    expect_exact({0, 1, 0, 0, 2, 0});
}
TEST(AliasTable, TinyWeightsStayReachable) {
    expect_exact({1e-30, 1, 1e-12, 5, 1e30});
}

TEST(AliasTable, ManyRandomWeights) {
    std::mt19937 random(3);
    std::vector<double> weights(10007);
    for (double& w : weights) w = random() % 5 == 0 ? 0.0 : std::pow(10.0, static_cast<double>(random() % 1000) / 100);
    expect_exact(weights);
}

}  // namespace
}  // namespace halflight
