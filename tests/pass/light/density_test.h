// Tests sampled directions against their density: chi-square over bins of the sphere.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "engine/core/math.h"
#include "tests/support/image_tests.h"

namespace halflight::test {

inline constexpr int kDensityRows = 24, kDensityColumns = 32, kDensitySteps = 16;  // bins; sub-steps per edge of a bin
inline constexpr std::uint32_t kDensityPoints = kDensityRows * kDensityColumns * kDensitySteps * kDensitySteps;

/// GLSL that returns one of kDensityPoints directions.
inline const char* const kDensityPoint = R"(
vec3 density_point(uint i) {
    float z = -1.0 + 2.0 * (float(i / 512u) + 0.5) / 384.0;
    float phi = 6.28318530718 * (float(i % 512u) + 0.5) / 512.0;
    return vec3(sqrt((1.0 - z) * (1.0 + z)) * vec2(cos(phi), sin(phi)), z);
}
)";

/// Expects samples (direction, density; density 0: no direction) to follow their density. `densities` has it in the
/// first component, at each density_point().
inline void expect_density(const std::vector<vec4>& samples, const std::vector<vec4>& densities,
                           const std::string& what) {
    constexpr int kWidth = kDensityColumns * kDensitySteps;
    const auto count = static_cast<double>(samples.size());
    std::vector<double> expected(kDensityRows * kDensityColumns, 0), found(expected.size(), 0);
    for (std::size_t i = 0; i < densities.size(); ++i) {
        const auto y = static_cast<int>(i) / kWidth / kDensitySteps, x = static_cast<int>(i) % kWidth / kDensitySteps;
        expected[static_cast<std::size_t>(y * kDensityColumns + x)] +=
            densities[i].x * 4 * kPi / kDensityPoints * count;
    }
    double lost = 0, lost_expected = count;
    for (const vec4& s : samples) {
        if (s.w <= 0) {
            ++lost;
            continue;
        }
        const int y = std::clamp(static_cast<int>((s.z + 1) / 2 * kDensityRows), 0, kDensityRows - 1);
        const double turn = std::atan2(s.y, s.x) / (2 * kPi);
        const int x =
            std::clamp(static_cast<int>((turn < 0 ? turn + 1 : turn) * kDensityColumns), 0, kDensityColumns - 1);
        ++found[static_cast<std::size_t>(y * kDensityColumns + x)];
    }
    // Too few points integrate the bins at a lobe's edge, so these are pooled with their neighbours. The rest of the
    // unit mass belongs to directions that the side rules or the horizon reject.
    double chi_square = 0, degrees = 0, pooled_expected = 0, pooled_found = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
        lost_expected -= expected[i];
        pooled_expected += expected[i];
        pooled_found += found[i];
        if (pooled_expected < 100) continue;
        chi_square += (pooled_found - pooled_expected) * (pooled_found - pooled_expected) / pooled_expected;
        ++degrees;
        pooled_expected = pooled_found = 0;
    }
    EXPECT_GT(chi_square_tail(chi_square, degrees), 1e-4) << what << ": " << chi_square << " of " << degrees;
    EXPECT_NEAR(lost, lost_expected, 5 * std::sqrt(std::max(lost, 100.0)) + 1e-3 * count) << what;
}

}  // namespace halflight::test
