#include "tools/common/color_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace halflight {
namespace {

/// Returns CIE L* of an sRGB signal, 0 to 100.
double lightness(const vec3& signal) {
    const auto linear = [](double v) { return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4); };
    const double y = 0.2126 * linear(signal.x) + 0.7152 * linear(signal.y) + 0.0722 * linear(signal.z);
    return y > 216.0 / 24389 ? 116 * std::cbrt(y) - 16 : y * 24389 / 27;
}

TEST(Magma, LightnessIsUniform) {
    EXPECT_LT(lightness(magma(0)), 1);
    EXPECT_GT(lightness(magma(1)), 97);
    for (int i = 0; i < 64; ++i) {
        const float t = static_cast<float>(i) / 64;
        const double step = (lightness(magma(t + 1.0f / 64)) - lightness(magma(t))) * 64 / 98;
        EXPECT_TRUE(step > 0.5 && step < 1.5) << t << ": " << step;  // the slope is smallest close to black
    }
    EXPECT_EQ(magma(-1), magma(0));
    EXPECT_EQ(magma(2), magma(1));
    Image map(2, 1, 1);
    map.pixels = {2, std::numeric_limits<float>::quiet_NaN()};
    const vec3 half = magma(0.5f);
    EXPECT_EQ(magma(map, 4).pixels, (std::vector<float>{half.r, half.g, half.b, 0, 1, 0}));
}

}  // namespace
}  // namespace halflight
