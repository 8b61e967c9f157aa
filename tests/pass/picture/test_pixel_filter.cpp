// Tests pixel filters in the renderer and in the oracle: the profile of an edge is the integral of the weights.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/core/error.h"
#include "engine/reference/reference.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

using Shape = PixelFilter::Shape;
using PixelFilterTest = GpuTest;

constexpr int kSide = 12;                   // pixels
constexpr double kEdge = 5.3, kLine = 6.8;  // edges of the light, pixels from the left and from the top

/// Returns the share of the filter's weights at t <= x / radius, by the midpoint rule on the weights of SHADING.md.
double share_below(const PixelFilter& filter, double x) {
    constexpr int kSteps = 4096;
    double below = 0, all = 0;
    for (int i = 0; i < kSteps; ++i) {
        const double t = (2 * i + 1.0) / kSteps - 1;
        const double w = filter.shape == Shape::box
                             ? 1
                             : 0.35875 + 0.48829 * std::cos(kPi * t) + 0.14128 * std::cos(2 * kPi * t) +
                                   0.01168 * std::cos(3 * kPi * t);
        all += w;
        below += t * filter.radius <= x ? w : 0;
    }
    return below / all;
}

/// Returns a light of radiance 1 left of kEdge and above kLine.
Scene corner_of_light() {
    Scene scene;
    const double left = -100, right = kEdge - kSide / 2.0, bottom = kSide / 2.0 - kLine;
    add_quad(scene, add_material(scene, light_material(vec3(1))), vec3(left, bottom, 0), vec3(right - left, 0, 0),
             vec3(0, 100, 0));
    return scene;
}

/// Returns a camera with pixels of one unit.
Camera camera_on_corner() {
    Camera camera = look_at_camera({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 1);
    camera.orthographic = true;
    camera.ortho_height = kSide;
    return camera;
}

/// Expects each pixel within `tolerance` of the integral over the lit quarter of the plane.
void expect_filtered(const Image& picture, const PixelFilter& filter, double tolerance) {
    double sum = 0, expected_sum = 0;
    for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
            const double expected = share_below(filter, kEdge - x - 0.5) * share_below(filter, kLine - y - 0.5);
            EXPECT_NEAR(picture.at(x, y)[1], expected, tolerance) << text(filter) << " at " << x << ' ' << y;
            sum += picture.at(x, y)[1], expected_sum += expected;
        }
    }
    EXPECT_NEAR(sum / expected_sum, 1, 0.005) << text(filter);
}

const PixelFilter kFilters[] = {
    {Shape::box, 0.5}, {Shape::box, 1.3}, {Shape::blackman_harris, 1.5}, {Shape::blackman_harris, 3}};

TEST_F(PixelFilterTest, EdgesShowItsShape) {
    const Scene scene = corner_of_light();
    RenderSettings settings = small_settings(camera_on_corner(), kSide, kSide, 4096, 0);
    settings.aovs.clear();
    for (const PixelFilter& filter : kFilters) {
        settings.filter = filter;
        // Rasterizers snap corners to 1/256 pixel, and no filter here has a weight above 1 per pixel.
        expect_filtered(render(context, scene, settings).beauty, filter, 0.008);
    }
}

TEST_F(PixelFilterTest, OracleHasEqualFilters) {
    const Scene scene = corner_of_light();
    const ReferenceScene oracle(scene);
    ReferenceSettings settings;
    settings.width = settings.height = kSide;
    settings.samples = 4096;
    settings.bounces = 0;
    settings.camera = camera_on_corner();
    for (const PixelFilter& filter : kFilters) {
        settings.filter = filter;
        expect_filtered(render_reference(oracle, settings).beauty, filter, 0.04);  // at most 5 standard errors
    }
}

TEST_F(PixelFilterTest, ConstantLightStaysExact) {
    Scene scene;
    scene.environment.color = vec3(0.25f, 1, 3);
    RenderSettings settings = small_settings(camera_on_corner(), kSide, kSide, 7, 0);
    settings.filter = {Shape::blackman_harris, 2};
    const Image picture = render(context, scene, settings).beauty;
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) {
            const float* p = picture.at(x, y);
            EXPECT_EQ(vec4(p[0], p[1], p[2], p[3]), vec4(0.25f, 1, 3, 1));
        }
}

TEST_F(PixelFilterTest, PicturesFollowTheFilterAndDataDoesNot) {
    const Scene scene = shiny_cornell();
    RenderSettings settings = all_settings(scene, 24, 16, 4);
    const RenderResult usual = render(context, scene, settings);
    settings.filter = {Shape::box, 0.5};
    expect_same(render(context, scene, settings), usual);
    settings.filter = {Shape::blackman_harris, 1.5};
    const RenderResult soft = render(context, scene, settings);
    EXPECT_FALSE(same_bits(soft.beauty, usual.beauty));
    EXPECT_TRUE(same_bits(layer(soft, "Z"), layer(usual, "Z")));
}

TEST_F(PixelFilterTest, RadiiOutOfRangeAreRefused) {
    const Scene scene = shiny_cornell();
    RenderSettings settings = all_settings(scene, 8, 8, 1);
    for (const double radius : {0.0, -1.0, 17.0, double(NAN)}) {
        settings.filter.radius = radius;
        EXPECT_THROW(render(context, scene, settings), Error) << radius;
    }
}

}  // namespace
}  // namespace halflight::test
