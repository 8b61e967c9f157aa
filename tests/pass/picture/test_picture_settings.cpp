// Tests settings of pictures: pixel filters in the renderer and in the oracle, clamped indirect light, and settings
// that are refused.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/reference/reference.h"
#include "engine/settings/visibility.h"
#include "renderer/settings_check.h"
#include "tests/pass/picture/pixels.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/error_message.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

// --- Pixel filters: the profile of an edge is the integral of the weights --------------------------------------------

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
    for (const auto& [x, y] : pixels_of(ivec2(kSide))) {
        const double expected = share_below(filter, kEdge - x - 0.5) * share_below(filter, kLine - y - 0.5);
        EXPECT_NEAR(picture.at(x, y)[1], expected, tolerance) << text(filter) << " at " << x << ' ' << y;
        sum += picture.at(x, y)[1], expected_sum += expected;
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
    for (const auto& [x, y] : pixels_of(ivec2(kSide))) {
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

// --- Clamped indirect light: which samples the clamp changes, and that its bias is reported --------------------------

using ClampTest = GpuTest;

double luminance(const float* p) {
    return 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2];
}

TEST_F(ClampTest, NoClampAndAHighClampChangeNothing) {
    const Scene scene = shiny_cornell();
    RenderSettings settings = all_settings(scene, 33, 29, 3);
    const RenderResult plain = render(context, scene, settings);
    EXPECT_TRUE(plain.stats.biases.empty());
    settings.clamp = 1e30f;
    expect_same(render(context, scene, settings), plain);
    settings.clamp = 0;
    settings.kept = Kept::everything();  // builds the clamping code, too
    expect_same(render(context, scene, settings), plain);
}

TEST_F(ClampTest, DimsBrightIndirectSamplesAndKeepsTheirHue) {
    const Scene scene = shiny_cornell();
    RenderSettings settings = small_settings(scene.cameras[0], 64, 48, 1, 4);
    const RenderResult plain = render(context, scene, settings);
    constexpr float kMost = 0.06f;
    settings.clamp = kMost;
    const RenderResult clamped = render(context, scene, settings);
    for (const char* untouched : {"emission.R", "direct_diffuse.R", "direct_glossy.R"})
        EXPECT_TRUE(same_bits(layer(clamped, untouched), layer(plain, untouched))) << untouched;
    int dimmed = 0, kept = 0;
    for (const char* name : {"indirect_diffuse.R", "indirect_glossy.R"}) {
        const Image &before = layer(plain, name), &after = layer(clamped, name);
        for (const auto& [x, y] : pixels_of({before.width, before.height})) {
            const float *b = before.at(x, y), *a = after.at(x, y);
            const double light = luminance(b);
            if (light <= kMost * (1 - 1e-5)) {
                ++kept;
                for (int c = 0; c < 3; ++c) ASSERT_EQ(a[c], b[c]);
            } else {
                ++dimmed;
                for (int c = 0; c < 3; ++c) ASSERT_NEAR(a[c], b[c] * kMost / light, 1e-5 * kMost);
            }
        }
    }
    EXPECT_GT(dimmed, 100);
    EXPECT_GT(kept, 1000);
}

TEST_F(ClampTest, IsReportedAsABias) {
    const Scene scene = shiny_cornell();
    RenderSettings settings = small_settings(scene.cameras[0], 16, 16, 1, 4);
    settings.clamp = 0.1f;
    const RenderResult clamped = render(context, scene, settings);
    EXPECT_EQ(clamped.stats.biases.size(), 1u);
    EXPECT_EQ(clamped.stats.layer_biases, clamped.stats.biases);
    settings.bounces = 1;
    EXPECT_TRUE(render(context, scene, settings).stats.biases.empty()) << "there is no indirect light";
}

// --- Settings that contradict each other, and what the message names ------------------------------------------------

struct Refusal {
    const char* named;  // what the message names
    void (*change)(RenderSettings& settings);
};

/// Settings that are good until a row changes them.
RenderSettings good_settings() {
    RenderSettings s;
    s.width = s.height = 16, s.samples = 64;
    s.camera.lens = {.aperture = 30, .focus = {.kind = Focus::Kind::distance, .distance = 1}};
    return s;
}

const Refusal kRefusals[] = {
    {"clamp", [](auto& s) { s.clamp = -1; }},
    {"radius", [](auto& s) { s.filter.radius = 0; }},
    {"radius", [](auto& s) { s.filter.radius = -1; }},
    {"radius", [](auto& s) { s.filter.radius = 17; }},
    {"radius", [](auto& s) { s.filter.radius = double(NAN); }},
    {"lens: the focus must be at a positive distance", [](auto& s) { s.camera.lens.focus.distance = 0; }},
    {"lens: the focus must be at a positive distance", [](auto& s) { s.camera.lens.focus.distance = double(NAN); }},
    {"lens: an aperture", [](auto& s) { s.camera.lens.blades = 2; }},
    {"lens: the focus must be at a point",
     [](auto& s) {
         s.camera.lens.focus = {.kind = Focus::Kind::point, .point = {0.5, 1.1}};
     }},
    {"orthographic",
     [](auto& s) { s.camera.orthographic = true, s.camera.lens.aperture = 0, s.camera.lens.fstop = 2; }},
    {"even height", [](auto& s) { s.camera.optics.stereo = Stereo::views, s.height = 17; }},
    {"even width", [](auto& s) { s.camera.optics.stereo = Stereo::side_by_side, s.width = 17; }},
    {"previous camera",
     [](auto& s) {
         s.camera.lens = {}, s.camera.optics.projection = Projection::panorama, s.previous_camera = Camera();
     }},
    {"a fisheye sees",
     [](auto& s) { s.camera.optics = {.projection = Projection::fisheye, .fisheye_fov = double(NAN)}; }},
};

TEST(RefusedSettings, AreNamed) {
    EXPECT_NO_THROW(check_settings(good_settings()));
    for (const Refusal& row : kRefusals) {
        RenderSettings settings = good_settings();
        row.change(settings);
        const std::string message = error_message([&] { check_settings(settings); });
        EXPECT_NE(message.find(row.named), std::string::npos) << row.named << ": " << message;
    }
}

TEST(RefusedSettings, RasterShowsNothingThatIsTraced) {
    for (const char* shown : {"panorama", "stereo", "depth of field"}) {
        const Optics optics{.projection = *shown == 'p' ? Projection::panorama : Projection::camera,
                            .stereo = *shown == 's' ? Stereo::left : Stereo::none};
        const std::string_view traced_for = shown_by_tracing(optics, *shown == 'd', false);
        const std::string message = error_message([&] {
            resolved(PrimaryVisibility::raster, 0, {16, 16}, traced_for);
        });
        EXPECT_NE(message.find(shown), std::string::npos) << message;
    }
}

}  // namespace
}  // namespace halflight::test
