// Tests metering and the exposure of a physical camera.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "renderer/metering.h"

namespace halflight {
namespace {

/// Returns a picture of 64 x 36 pixels; value(x, y) is the radiance at x, y in [-1,1].
template <class F>
Image picture_of(const F& value) {
    Image picture(64, 36, 4);
    for (int y = 0; y < picture.height; ++y)
        for (int x = 0; x < picture.width; ++x) {
            const auto v = static_cast<float>(value((2 * x + 1) / 64.0 - 1, (2 * y + 1) / 36.0 - 1));
            std::fill_n(picture.at(x, y), 3, v);
        }
    return picture;
}

Image grey(double value) {
    return picture_of([&](double, double) { return value; });
}

TEST(Metering, BringsGreyToTheGreyCard) {
    EXPECT_FLOAT_EQ(metered_exposure(grey(1000)), -12.44f) << "log2(0.18 / 1000), in steps of 0.01";
    EXPECT_FLOAT_EQ(metered_exposure(grey(1e-6)), 17.46f);
    EXPECT_EQ(metered_exposure(grey(1e30)), -64) << "the range of the setting";
    for (const double level : {0.023, 0.05, 0.18, 0.5, 1.0, 1.4}) EXPECT_EQ(metered_exposure(grey(level)), 0) << level;
    EXPECT_NE(metered_exposure(grey(0.022)), 0);
    EXPECT_NE(metered_exposure(grey(1.5)), 0);
}

TEST(Metering, BlackAndInvalidPixelsDoNotCount) {
    EXPECT_EQ(metered_exposure(grey(0)), 0);
    EXPECT_EQ(metered_exposure(Image()), 0);
    const double infinity = std::numeric_limits<double>::infinity();
    for (const double odd : {0.0, -1.0, std::nan(""), infinity})
        EXPECT_FLOAT_EQ(metered_exposure(picture_of([&](double x, double) { return x < 0.5 ? odd : 1000; })), -12.44f);
}

TEST(Metering, IsRobust) {
    const float plain = metered_exposure(grey(1000));
    EXPECT_FLOAT_EQ(metered_exposure(picture_of([](double x, double y) { return x > 0.9 && y > 0.6 ? 1e12 : 1000; })),
                    plain)
        << "a lamp in a corner";
    EXPECT_FLOAT_EQ(metered_exposure(picture_of([](double x, double) { return std::abs(x) > 0.85 ? 1e-6 : 1000; })),
                    plain)
        << "dark edges";
}

TEST(Metering, ScalesWithThePicture) {
    const auto scene = [](double scale) {
        return metered_exposure(picture_of([=](double x, double y) { return scale * (2 + std::sin(9 * x + 5 * y)); }));
    };
    for (const double stops : {6.0, 9.0, 14.0, -9.0, -13.0})
        EXPECT_NEAR(scene(std::exp2(stops)), scene(std::exp2(10.0)) + 10 - stops, 0.011) << stops;
}

TEST(Metering, TheCentreOfEachEyeWeighsMore) {
    const auto disc = [](double inside, double outside) {
        return metered_exposure(
            picture_of([=](double x, double y) { return std::hypot(x, y) < 0.8 ? inside : outside; }));
    };
    EXPECT_GT(disc(100, 200), disc(200, 100)) << "nearly as many pixels are inside as outside";
    // Each half, the picture of an eye, has the same disc. If metering ignored the layout, the seam would weigh most.
    const auto discs = [](double inside, double outside) {
        return metered_exposure(
            picture_of([=](double x, double y) { return std::hypot(x, 2 * std::abs(y) - 1) < 0.8 ? inside : outside; }),
            {.stereo = Stereo::over_under});
    };
    EXPECT_GT(discs(100, 200), discs(200, 100));
}

TEST(Metering, PolesOfPanoramasWeighLittle) {
    const Image poles = picture_of([](double, double y) { return std::abs(y) > 0.75 ? 1e6 : 1000; });
    EXPECT_FLOAT_EQ(metered_exposure(poles, {.projection = Projection::panorama}), -12.44f) << "4 % of the sphere";
    EXPECT_LT(metered_exposure(poles), -13);
}

TEST(Metering, KeepsHighlights) {
    // Half of the picture is 2^20 times brighter than the other half.
    const float stops = metered_exposure(picture_of([](double x, double) { return x < 0 ? 1e-3 : 1e3; }));
    EXPECT_NEAR(1e3 * std::exp2(double(stops)), 4, 0.04);
}

TEST(PhysicalCamera, FollowsTheEquations) {
    ViewTransform view;
    EXPECT_TRUE(view.metered());
    view.camera.lens.fstop = 16;
    EXPECT_FALSE(view.metered()) << "it replaces metering";
    const auto stops = [&](PhysicalCamera camera) {
        view.camera = camera;
        return view.stops() + std::log2(1.2);
    };
    EXPECT_NEAR(stops({.iso = 100, .shutter_speed = {1}, .lens = {.fstop = 1}}), 0, 1e-6) << "EV100 is 0";
    EXPECT_NEAR(stops({.iso = 100, .shutter_speed = {1}, .lens = {.fstop = 2}}), -2, 1e-6);
    EXPECT_NEAR(stops({.iso = 100, .shutter_speed = {1.0f / 128}, .lens = {.fstop = 2}}), -9, 1e-5);
    EXPECT_NEAR(stops({.iso = 1600, .shutter_speed = {1.0f / 128}, .lens = {.fstop = 2}}), -5, 1e-5);
    EXPECT_NEAR(stops({.iso = 100}), -std::log2(256.0 * 125), 1e-5) << "f/16 and 1/125 s";
    view.exposure = 1.5f;
    EXPECT_NEAR(stops({.iso = 100}), 1.5 - std::log2(256.0 * 125), 1e-5) << "a correction";
}

}  // namespace
}  // namespace halflight
