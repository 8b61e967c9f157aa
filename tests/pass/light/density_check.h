// A chi-square test of directions that a BSDF samples.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/core/math.h"
#include "tests/support/image_tests.h"

namespace halflight {

/// Expects that the directions of a function of shaders/lib/bsdf.glsl follow a member of BsdfValue. `run` runs a kernel
/// that can use bsdf_of(0u), wo_of(0u) and random_at().
template <class Run>
void expect_density(const Run& run, const std::string& sampler, const std::string& pdf, const std::string& what) {
    constexpr std::uint32_t kSamples = 1u << 17;
    constexpr int kRows = 24, kColumns = 32, kSub = 16;  // rows and columns of bins; sub-steps per edge of a bin
    const std::vector<vec4> samples = run(R"(
        vec2 xi = vec2(random_at(i, 0u), random_at(i, 1u));
        BsdfSample s = )" + sampler + R"((bsdf_of(0u), wo_of(0u), xi, random_at(i, 2u));
        result[0] = vec4(s.direction, s.pdf);
    )",
                                          kSamples);
    const std::vector<vec4> densities = run(R"(
        float z = -1.0 + 2.0 * (float(i / 512u) + 0.5) / 384.0;
        float phi = 6.28318530718 * (float(i % 512u) + 0.5) / 512.0;
        vec3 wi = vec3(sqrt(1.0 - z * z) * vec2(cos(phi), sin(phi)), z);
        result[0] = vec4(evaluate_bsdf(bsdf_of(0u), wo_of(0u), wi).)" +
                                                pdf + R"(, 0.0, 0.0, 0.0);
    )",
                                            kRows * kSub * kColumns * kSub);

    std::vector<double> expected(kRows * kColumns, 0), found(kRows * kColumns, 0);
    for (int y = 0; y < kRows * kSub; ++y)
        for (int x = 0; x < kColumns * kSub; ++x)
            expected[static_cast<std::size_t>(y / kSub * kColumns + x / kSub)] +=
                densities[static_cast<std::size_t>(y * kColumns * kSub + x)].x * 4 * kPi /
                (kRows * kSub * kColumns * kSub) * kSamples;
    double lost = 0, lost_expected = kSamples;
    for (const vec4& s : samples) {
        if (s.w <= 0) {
            ++lost;
            continue;
        }
        const int y = std::clamp(static_cast<int>((s.z + 1) / 2 * kRows), 0, kRows - 1);
        const double turn = std::atan2(s.y, s.x) / (2 * kPi);
        const int x = std::clamp(static_cast<int>((turn < 0 ? turn + 1 : turn) * kColumns), 0, kColumns - 1);
        ++found[static_cast<std::size_t>(y * kColumns + x)];
    }
    // Too few points integrate the bins at the lobe's edge, so these are pooled with their neighbours. The rest of the
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
    EXPECT_GT(test::chi_square_tail(chi_square, degrees), 1e-4)
        << what << ", " << sampler << ": " << chi_square << " of " << degrees;
    EXPECT_NEAR(lost, lost_expected, 5 * std::sqrt(std::max(lost, 100.0)) + 1e-3 * kSamples) << what << ", " << sampler;
}

}  // namespace halflight
