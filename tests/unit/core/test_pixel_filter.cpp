// Tests that sample points follow the distribution of the filter's weights.
#include "engine/core/pixel_filter.h"

#include <gtest/gtest.h>

#include <cmath>

namespace halflight {
namespace {

using Shape = PixelFilter::Shape;

constexpr int kSteps = 1 << 16;

/// Returns the window of SHADING.md, "Camera".
double blackman_harris(double t) {
    return 0.35875 + 0.48829 * std::cos(kPi * t) + 0.14128 * std::cos(2 * kPi * t) + 0.01168 * std::cos(3 * kPi * t);
}

TEST(PixelFilter, DefaultBoxIsTheIdentity) {
    for (int i = 0; i < kSteps; ++i) {
        const vec2 xi(static_cast<float>(i * 255 + 1) * 0x1p-24f, static_cast<float>(i) * 0x1p-16f);
        ASSERT_EQ(sample_point({}, xi), xi);
    }
}

TEST(PixelFilter, BoxIsUniform) {
    const PixelFilter box{Shape::box, 2};
    EXPECT_EQ(sample_point(box, {0, 0.25f}), vec2(-1.5f, -0.5f));
    EXPECT_EQ(sample_point(box, {0.5f, 0.75f}), vec2(0.5f, 1.5f));
}

TEST(PixelFilter, BlackmanHarrisPointsFollowItsWeights) {
    const PixelFilter filter{Shape::blackman_harris, 1.5};
    // Equally spaced numbers u give points with equal shares of the weight between them.
    constexpr int kPoints = 1 << 10;
    double all = 0;
    for (int i = 0; i < kSteps; ++i) all += blackman_harris((2 * i + 1.0) / kSteps - 1);
    double below = 0;
    int step = 0;
    float last = -1;
    for (int i = 1; i < kPoints; ++i) {
        const float u = static_cast<float>(i) / kPoints;
        const vec2 point = sample_point(filter, {u, 1 - u});
        EXPECT_GT(point.x, last);
        last = point.x;
        EXPECT_NEAR(point.x - 0.5, 0.5 - point.y, 1e-6) << "symmetric, and the same in both directions";
        const double t = (point.x - 0.5) / filter.radius;
        for (; (2 * step + 1.0) / kSteps - 1 < t; ++step) below += blackman_harris((2 * step + 1.0) / kSteps - 1);
        EXPECT_NEAR(below / all, u, 5e-5);  // tolerance: one step at the peak
    }
    EXPECT_GE(sample_point(filter, {0, 0}).x, -1.0f);
    EXPECT_LE(sample_point(filter, {1 - 0x1p-24f, 0}).x, 2.0f);
    EXPECT_GT(sample_point(filter, {1 - 0x1p-24f, 0}).x, 1.8f);
}

}  // namespace
}  // namespace halflight
