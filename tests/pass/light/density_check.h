// Chi-square tests of counts, and of directions in bins of equal solid angle.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "engine/core/math.h"
#include "tests/support/image_tests.h"

namespace halflight::test {

struct ChiSquare {
    double value = 0, degrees = 0;
    double p_value() const { return degrees > 0 ? chi_square_tail(value, degrees) : std::isfinite(value) ? 1 : 0; }
};

/// Returns chi-square of counts. Neighbouring bins are pooled until `least` counts are expected. It is infinite if bins
/// at the end, where fewer are expected, have far too many.
inline ChiSquare chi_square(const std::vector<double>& found, const std::vector<double>& expected, double least) {
    ChiSquare result;
    double pooled_expected = 0, pooled_found = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
        pooled_expected += expected[i];
        pooled_found += found[i];
        if (pooled_expected < least) continue;
        result.value += (pooled_found - pooled_expected) * (pooled_found - pooled_expected) / pooled_expected;
        ++result.degrees;
        pooled_expected = pooled_found = 0;
    }
    if (pooled_found > pooled_expected + 10 * std::sqrt(pooled_expected + 1))
        return {std::numeric_limits<double>::infinity(), 0};
    return result;
}

/// Counts of directions in bins of equal solid angle, and those expected by a density.
struct DirectionBins {
    static constexpr int kRows = 24, kColumns = 32, kSub = 16;  // kSub: grid points per edge of a bin
    static constexpr int kGrid = kRows * kSub * kColumns * kSub;

    std::vector<double> expected = std::vector<double>(kRows * kColumns), found = expected;
    double directions = 0;  // number of directions counted

    /// Returns direction `i` of the grid on which densities are integrated, i in [0, kGrid).
    static dvec3 grid_direction(int i) {
        const double z = -1 + 2 * (i / (kColumns * kSub) + 0.5) / (kRows * kSub), r = std::sqrt(1 - z * z);
        const double phi = 2 * kPi * (i % (kColumns * kSub) + 0.5) / (kColumns * kSub);
        return {r * std::cos(phi), r * std::sin(phi), z};
    }
    /// Adds the density at grid_direction(i). `total` is the number of samples drawn.
    void expect(int i, double density, double total) {
        const int row = i / (kColumns * kSub) / kSub, column = i % (kColumns * kSub) / kSub;
        expected[static_cast<std::size_t>(row * kColumns + column)] += density * 4 * kPi / kGrid * total;
    }
    void count(const dvec3& d) {
        const double turn = std::atan2(d.y, d.x) / (2 * kPi);
        const int row = std::clamp(static_cast<int>((d.z + 1) / 2 * kRows), 0, kRows - 1);
        const int column = std::clamp(static_cast<int>((turn < 0 ? turn + 1 : turn) * kColumns), 0, kColumns - 1);
        ++found[static_cast<std::size_t>(row * kColumns + column)];
        ++directions;
    }
    double expected_directions() const {
        double sum = 0;
        for (const double e : expected) sum += e;
        return sum;
    }
};

}  // namespace halflight::test
