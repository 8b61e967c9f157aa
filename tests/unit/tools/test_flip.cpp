// Tests FLIP on pictures with a closed form: uniform images, and waves in one direction.
#include "tools/measure/common/flip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "engine/core/math.h"
#include "engine/core/metrics.h"

namespace halflight {
namespace {

Image picture(int width, int height, const std::function<vec3(int, int)>& color) {
    Image image(width, height, 3);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const vec3 c = color(x, y);
            std::copy_n(&c.x, 3, image.at(x, y));
        }
    }
    return image;
}

Image uniform(const vec3& color) {
    return picture(24, 20, [&](int, int) { return color; });
}

double uniform_flip(const vec3& a, const vec3& b) {
    const Image map = flip_map(uniform(a), uniform(b));
    const auto [least, most] = std::ranges::minmax(map.pixels);
    EXPECT_NEAR(least, most, 1e-5);
    return mean_of(map);
}

// L*a*b* of the green, blue and red primaries of Rec.709 with white D65 (Lindbloom's colour calculator).
constexpr std::array<double, 3> kGreen{87.735, -86.183, 83.180}, kBlue{32.297, 79.188, -107.860},
    kRed{53.241, 80.092, 67.203};

double hyab_of_hunt(const std::array<double, 3>& p, const std::array<double, 3>& q) {
    const auto hunt = [](const std::array<double, 3>& c, std::size_t i) { return 0.01 * c[0] * c[i]; };
    return std::abs(p[0] - q[0]) + std::hypot(hunt(p, 1) - hunt(q, 1), hunt(p, 2) - hunt(q, 2));
}

/// Returns FLIP's colour error between two uniform colours, given as L*a*b*.
double color_error(const std::array<double, 3>& p, const std::array<double, 3>& q) {
    const double e = std::pow(hyab_of_hunt(p, q), 0.7), most = std::pow(hyab_of_hunt(kGreen, kBlue), 0.7);
    return e < 0.4 * most ? e / (0.4 * most) * 0.95 : 0.95 + (e - 0.4 * most) / (0.6 * most) * 0.05;
}

TEST(Flip, UniformColorsHaveTheirHuntAdjustedDistance) {
    EXPECT_EQ(uniform_flip(vec3(0.5f), vec3(0.5f)), 0);
    EXPECT_NEAR(uniform_flip({0, 1, 0}, {0, 0, 1}), 1, 1e-5);
    EXPECT_NEAR(uniform_flip(vec3(0), vec3(1)), color_error({0, 0, 0}, {100, 0, 0}), 2e-4);
    EXPECT_NEAR(uniform_flip(vec3(0), vec3(1)), 0.967, 1e-3);
    EXPECT_NEAR(uniform_flip({1, 0, 0}, {0, 1, 0}), color_error(kRed, kGreen), 2e-4);
    EXPECT_NEAR(uniform_flip({1, 0, 0}, vec3(0)), color_error(kRed, {0, 0, 0}), 2e-4);
    // Grey of 18.4187 % has L* = 50 (CIE 15), grey of 1.1260 % has L* = 10.
    EXPECT_NEAR(uniform_flip(vec3(0.184187f), vec3(0.011260f)), color_error({50, 0, 0}, {10, 0, 0}), 2e-4);
}

TEST(Flip, IsSymmetricGrowsWithContrastAndStaysInRange) {
    const auto checks = [](float contrast) {
        return picture(40, 40, [=](int x, int y) { return vec3(0.3f + ((x / 4 + y / 4) % 2 ? contrast : -contrast)); });
    };
    double before = 0;
    for (const float contrast : {0.01f, 0.03f, 0.1f, 0.2f, 0.3f}) {
        const Image forth = flip_map(checks(contrast), checks(0)), back = flip_map(checks(0), checks(contrast));
        EXPECT_EQ(forth.pixels, back.pixels);
        EXPECT_GT(mean_of(forth), 1.1 * before);
        EXPECT_LE(std::ranges::max(forth.pixels), 1);
        before = mean_of(forth);
    }
    // A black and white edge and its negative have equal features everywhere and equal colours nowhere.
    const auto step = [](bool left) { return picture(64, 8, [=](int x, int) { return vec3((x < 32) == left); }); };
    EXPECT_GT(mean_of(flip_map(step(true), step(false))), 0.9);
}

/// Returns the error at the crest of a vertical grey wave of `cycles` per degree against its mean grey. Evaluates the
/// frequency responses of the filters in double precision instead of convolving.
double wave_flip(double mean, double amplitude, double cycles, double ppd) {
    const double step = 2 * std::numbers::pi * cycles / ppd;  // radians per pixel
    const double sensed = amplitude * std::exp(-0.0047 * cycles * cycles);
    const auto lightness = [](double y) { return 116 * std::cbrt(y) - 16; };
    const double distance = std::abs(lightness(mean + sensed) - lightness(mean));
    const double knee = 0.4 * std::pow(hyab_of_hunt(kGreen, kBlue), 0.7);
    const double color = std::pow(distance, 0.7) / knee * 0.95;

    const double deviation = 0.5 * 0.082 * ppd;
    const int reach = static_cast<int>(std::ceil(3 * deviation));
    const auto bend = [&](int i) {
        return (i * i / (deviation * deviation) - 1) * std::exp(-i * i / (2 * deviation * deviation));
    };
    double point = 0, positive = 0, negative = 0;  // a crest has no edge
    for (int i = -reach; i <= reach; ++i) (bend(i) > 0 ? positive : negative) += std::abs(bend(i));
    for (int i = -reach; i <= reach; ++i) point += bend(i) / (bend(i) > 0 ? positive : negative) * std::cos(step * i);
    return std::pow(color, 1 - std::sqrt(amplitude * std::abs(point) / std::sqrt(2.0)));
}

TEST(Flip, WavesFollowTheContrastSensitivity) {
    constexpr double kPpd = 67;
    constexpr int kWidth = 268, kHeight = 3;
    for (const int period : {67, 20, 10}) {  // pixels
        const double cycles = kPpd / period;
        const auto wave = [&](double amplitude) {
            return picture(kWidth, kHeight, [=](int x, int) {
                return vec3(static_cast<float>(0.4 + amplitude * std::cos(2 * std::numbers::pi * x / period)));
            });
        };
        const Image map = flip_map(wave(0.1), wave(0), kPpd);
        const int crest = kWidth / 2 / period * period;
        // The filter ends at three standard deviations of the widest Gaussian, more than four of the luminance
        // Gaussian.
        EXPECT_NEAR(*map.at(crest, 1), wave_flip(0.4, 0.1, cycles, kPpd), 1e-3) << period;
    }
}

TEST(HdrFlip, RangesFromTheBrightestToTheMedian) {
    Image reference = uniform(vec3(0.25f));
    std::fill_n(reference.at(3, 3), 3, 16.0f);
    const ExposureRange range = flip_exposures(reference);
    EXPECT_NEAR(range.last - range.first, std::log2(16 / 0.25), 1e-5);
    EXPECT_EQ(range.count, 6);
    // The curve (0.9036 x^2 + 0.018 x) / (0.8748 x^2 + 0.354 x + 0.14) maps the brightest value to 0.85 at the first
    // exposure.
    const double x = 16 * std::exp2(range.first);
    EXPECT_NEAR((0.9036 * x * x + 0.018 * x) / (0.8748 * x * x + 0.354 * x + 0.14), 0.85, 1e-6);
    EXPECT_EQ(flip_exposures(uniform(vec3(1))).count, 2);
    EXPECT_EQ(flip_exposures(uniform(vec3(0))).first, 0);

    Image mostly_black = uniform(vec3(0));
    std::fill_n(mostly_black.at(3, 3), 3, 1.0f);
    EXPECT_EQ(flip_exposures(mostly_black).count, 23);
}

TEST(HdrFlip, IsTheMaximumOverExposures) {
    const auto scene = [](float dark, float bright) {
        return picture(48, 24, [=](int x, int) { return vec3(x < 32 ? dark : bright); });
    };
    const Image reference = scene(0.05f, 20);
    EXPECT_EQ(mean_of(hdr_flip_map(reference, reference)), 0);
    const Image darker = hdr_flip_map(scene(0.04f, 20), reference),
                brighter = hdr_flip_map(scene(0.05f, 40), reference);
    EXPECT_GT(*darker.at(8, 12), 0.1f);
    EXPECT_LT(*darker.at(44, 12), 0.01f);
    EXPECT_GT(*brighter.at(44, 12), 0.1f);
    EXPECT_LT(*brighter.at(8, 12), 0.01f);

    // The exposure range scales with the scene.
    const Image scaled = hdr_flip_map(scene(0.04f * 8, 20 * 8), scene(0.05f * 8, 20 * 8));
    for (std::size_t i = 0; i < scaled.pixels.size(); ++i) EXPECT_NEAR(scaled.pixels[i], darker.pixels[i], 1e-4);
}

TEST(HdrFlip, StaysFiniteForAnyInput) {
    constexpr float kInf = std::numeric_limits<float>::infinity(), kNan = std::numeric_limits<float>::quiet_NaN();
    Image odd = uniform(vec3(1)), reference = odd;
    odd.at(3, 3)[0] = kNan, odd.at(5, 5)[1] = kInf, odd.at(7, 7)[2] = -kInf, reference.at(9, 9)[0] = kInf;
    for (const Image& map :
         {hdr_flip_map(odd, reference), flip_map(odd, reference), hdr_flip_map(odd, uniform(vec3(0)))})
        for (const float v : map.pixels) EXPECT_TRUE(v >= 0 && v <= 1) << v;
    Image grey(8, 8, 1), with_alpha(8, 8, 4);
    EXPECT_EQ(mean_of(hdr_flip_map(grey, grey)) + mean_of(hdr_flip_map(with_alpha, with_alpha)), 0);
}

}  // namespace
}  // namespace halflight
