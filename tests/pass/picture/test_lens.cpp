// Tests depth of field: the circle of confusion against the thin lens equation, the aperture's shape, what is in focus,
// and that nothing else changes.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/pass/picture/pixels.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/error_message.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Lens lens_at(double distance, double aperture, int blades = 0, double rotation = 0) {
    return {.aperture = aperture,
            .focus = {.kind = Focus::Kind::distance, .distance = distance},
            .blades = blades,
            .rotation = rotation};
}

/// The blurred image of a small light.
struct Blur {
    double light = 0;        // sum over the picture
    dvec2 centre{0};         // pixels from the middle of the picture, x right, y up
    dvec2 variance{0};       // per axis, pixels^2
    std::vector<dvec3> lit;  // xy: pixel, as above; z: radiance
};

class LensTest : public GpuTest {
  protected:
    static constexpr int kWidth = 72, kHeight = 48;
    static constexpr double kSide = 3;  // side of the light's sharp image, pixels

    static Camera camera_with(const Lens& lens, bool orthographic = false) {
        Camera camera = look_at_camera({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 0.12);
        camera.orthographic = orthographic;
        camera.ortho_height = 0.5;
        camera.lens = lens;
        return camera;
    }
    /// Returns the pixels of a length of 1 at a distance.
    static double pixels_per_metre(const Camera& camera, double distance) {
        return kHeight / (camera.orthographic ? camera.ortho_height : 2 * std::tan(camera.vertical_fov / 2) * distance);
    }
    /// Renders a square light at a distance, seen `at` pixels right of and above the middle of the picture.
    Blur blur(const Camera& camera, double distance, const dvec2& at = dvec2(0), Estimator estimator = {}) {
        Scene lit;
        const double metre = pixels_per_metre(camera, distance), half = kSide / 2 / metre;
        const dvec3 middle(at / metre, -distance);
        add_quad(lit, add_material(lit, light_material(vec3(1))), vec3(middle - dvec3(half, half, 0)),
                 vec3(2 * half, 0, 0), vec3(0, 2 * half, 0));
        RenderSettings settings = small_settings(camera, kWidth, kHeight, 512, 0);
        settings.estimator = estimator;
        const Image image = render(context, lit, settings).beauty;
        Blur b;
        dvec2 squares(0);
        for (const auto& [x, y] : pixels_of({kWidth, kHeight})) {
            const double value = double{*image.at(x, y)};
            const dvec2 p(x + 0.5 - kWidth / 2.0, kHeight / 2.0 - y - 0.5);
            b.light += value;
            b.centre += value * p;
            squares += value * p * p;
            if (value > 0) b.lit.emplace_back(p, value);
        }
        b.centre /= b.light;
        b.variance = squares / b.light - b.centre * b.centre;
        return b;
    }
    /// Returns settings for a view of near and far surfaces through a lens.
    RenderSettings deep_settings(const Lens& lens, int width, int height, int samples) const {
        RenderSettings settings = all_settings(scene, width, height, samples);
        settings.camera.lens = lens;
        return settings;
    }
    /// Returns the aperture's radius in the picture, from the variance of the blur. It is the sum of the variances of
    /// the aperture, of the light's sharp image and of a pixel. Per axis, that of a regular polygon is radius^2 (2 +
    /// cos(2 pi / n)) / 12.
    static double radius_of(double variance, int blades = 0) {
        const double corner = blades > 0 ? std::cos(2 * kPi / blades) : 1;
        return std::sqrt(12 / (2 + corner) * (variance - kSide * kSide / 12 - 1.0 / 12));
    }

    const Scene scene = shiny_cornell();
};

TEST_F(LensTest, CircleOfConfusion) {
    constexpr double kTolerance = 0.1;  // pixels
    struct Case {
        double focus, distance;
        int blades;
        dvec2 at;
        Estimator estimator;
    };
    const Case cases[] = {
        {2, 4, 0, dvec2(0), {}},
        {2, 1.3, 0, dvec2(12, -7), {}},
        {kInfinity, 3, 0, dvec2(-9, 3), {}},
        {3, kInfinity, 0, dvec2(0), {}},
        {2, 4, 6, dvec2(5, 5), {}},
        {2, 1.3, 3, dvec2(0), {}},
        {2, 4, 0, dvec2(0), {.camera = CameraRays::four}},
        {2, 4, 5, dvec2(0), {.sampler = SamplePoints::independent}},
    };
    for (const Case& c : cases) {
        Lens lens = lens_at(c.focus, 0, c.blades, 20);
        lens.fstop = 1.4f;
        const Camera camera = camera_with(lens);
        // The longer side of the picture is 36 mm long, so the sensor is v behind the lens. A thin lens that projects
        // the plane of focus there has the focal length f, and its circle of confusion is A |d - F| / d f / (F - f).
        const double side = 2 * std::tan(camera.vertical_fov / 2) * kWidth / kHeight;
        const double v = 0.036 / side, diameter = v / double{1.4f};
        const double focal = std::isinf(c.focus) ? v : v * c.focus / (v + c.focus);
        const double far = std::isinf(c.distance) ? 1e4 : c.distance;
        const double circle = std::isinf(c.focus)
                                  ? diameter / far * v
                                  : diameter * std::abs(far - c.focus) / far * focal / (c.focus - focal);
        const double radius = circle / 2 * kWidth / 0.036;
        const Blur b = blur(camera, far, c.at, c.estimator);
        const std::string what = fmt::format("focus {}, light {}, {} blades", c.focus, far, c.blades);
        EXPECT_GT(radius, 5) << what;
        EXPECT_NEAR(b.light, kSide * kSide, 0.03 * kSide * kSide) << what << ": light is neither lost nor added";
        EXPECT_NEAR(b.centre.x, c.at.x, kTolerance) << what;
        EXPECT_NEAR(b.centre.y, c.at.y, kTolerance) << what;
        EXPECT_NEAR(radius_of(b.variance.x, c.blades), radius, kTolerance) << what;
        EXPECT_NEAR(radius_of(b.variance.y, c.blades), radius, kTolerance) << what;
    }
}

TEST_F(LensTest, OrthographicLens) {
    const Blur b = blur(camera_with(lens_at(2, 100), true), 3, {4, 2});
    const double radius = 0.05 * std::abs(1 - 3 / 2.0) * pixels_per_metre(camera_with({}, true), 3);
    EXPECT_NEAR(radius_of(b.variance.x), radius, 0.1);
    EXPECT_NEAR(b.centre.x, 4, 0.1);
}

TEST_F(LensTest, BladesAreEdgesOfTheBlur) {
    for (const double rotation : {0.0, 90.0, 200.0}) {
        for (const double distance : {5.0, 1.2}) {  // behind the focus the blur is upright, before it upside down
            const double radius = 0.15 * std::abs(1 / 2.0 - 1 / distance) * pixels_per_metre(camera_with({}), 1);
            const Blur b = blur(camera_with(lens_at(2, 300, 3, rotation)), distance);
            double most = 0, least = 0;  // extent along the normal of the first edge
            const double turn = glm::radians(rotation) + (distance < 2 ? kPi : 0);
            for (const dvec3& pixel : b.lit) {
                const double along = glm::dot(dvec2(pixel), dvec2(std::cos(turn), std::sin(turn)));
                most = std::max(most, along), least = std::min(least, along);
            }
            const double pixel = kSide / std::sqrt(2.0) + 0.8;  // half diagonals of the light and of a pixel
            EXPECT_NEAR(most, radius / 2, pixel) << rotation << ", " << distance;
            EXPECT_NEAR(least, -radius, pixel) << rotation << ", " << distance;
            EXPECT_GT(radius / 2, 2 * pixel);
        }
    }
}

TEST_F(LensTest, TheFocusIsSharp) {
    const Blur sharp = blur(camera_with({}), 2), focused = blur(camera_with(lens_at(2, 500)), 2);
    EXPECT_NEAR(focused.variance.x, sharp.variance.x, 0.02);
    EXPECT_NEAR(focused.variance.y, sharp.variance.y, 0.02);
}

TEST_F(LensTest, LensesThatBlurNothingChangeNothing) {
    RenderSettings settings = deep_settings({}, 48, 32, 4);
    const RenderResult pinhole = render(context, scene, settings);
    for (const Lens& lens :
         {lens_at(1, 0, 5), Lens{.fstop = 2}, Lens{.fstop = 2, .focus = {.kind = Focus::Kind::none}}}) {
        settings.camera.lens = lens;
        expect_same(render(context, scene, settings), pinhole);
    }
    EXPECT_FALSE(pinhole.stats.lens.blurs());
}

TEST_F(LensTest, PicturesDependNeitherOnCullingNorOnBands) {
    RenderSettings settings = deep_settings(lens_at(1, 30, 6), 48, 80, 6);
    settings.culling = rays::Culling::off;
    const RenderResult whole = render(context, scene, settings);
    EXPECT_EQ(whole.stats.primary, PrimaryVisibility::traced);
    for (const rays::Culling culling : {rays::Culling::compute, rays::Culling::raster}) {
        settings.culling = culling;
        expect_same(render(context, scene, settings), whole);
    }
    settings.culling = rays::Culling::off;
    settings.band_pixels = 1;
    expect_same(render(context, scene, settings), whole);
}

/// Layers at pixel centres are those of a pinhole camera, so a focus at a point has the depth there.
TEST_F(LensTest, FocusAtAPointOfThePicture) {
    constexpr int kColumns = 48, kRows = 32;
    for (const bool orthographic : {false, true}) {
        RenderSettings settings = deep_settings({}, kColumns, kRows, 4);
        settings.primary = PrimaryVisibility::traced;
        settings.camera.orthographic = orthographic;
        settings.camera.ortho_height = 0.4;
        const RenderResult pinhole = render(context, scene, settings);
        for (const ivec2& pixel : {ivec2(20, 9), ivec2(40, 25)}) {
            settings.camera.lens = {.aperture = 30, .focus = {.kind = Focus::Kind::point}};
            Focus& focus = settings.camera.lens.focus;
            focus.point = (dvec2(pixel) + 0.5) / dvec2(kColumns, kRows);
            const RenderResult at_point = render(context, scene, settings);
            const double distance = at_point.stats.lens.focus.distance;
            EXPECT_NEAR(distance, double{*layer(at_point, "Z").at(pixel.x, pixel.y)}, 1e-5 * distance);
            for (const char* channel : {"Z", "position.X", "motion.X", "ids.instance"})
                EXPECT_TRUE(same_bits(layer(at_point, channel), layer(pinhole, channel))) << channel;
            for (const char* channel : {"direct_diffuse.R", "albedo.R"})
                EXPECT_FALSE(same_bits(layer(at_point, channel), layer(pinhole, channel))) << channel;
            focus = {.kind = Focus::Kind::distance, .distance = distance};
            expect_same(render(context, scene, settings), at_point);
        }
    }
}

TEST_F(LensTest, FocusOnTheSkyIsInfinity) {
    Scene floor = floor_scene(diffuse_material(vec3(0.5f)), 10);
    floor.environment.color = vec3(1);
    Camera camera = look_at_camera({0, 1, 4}, {0, 1, 0}, {0, 1, 0}, 0.8);
    camera.lens = {.aperture = 30, .focus = {.kind = Focus::Kind::point, .point = {0.5, 0.1}}};
    const RenderSettings settings = small_settings(camera, 16, 16, 2, 1);
    EXPECT_EQ(render(context, floor, settings).stats.lens.focus.distance, kInfinity);
}

/// A renderer follows lens and projection of its frames, and a frame that is refused leaves it as it was.
TEST_F(LensTest, ARendererFollowsItsCamera) {
    RenderSettings settings = deep_settings({}, 32, 32, 2);
    settings.denoise = true;
    Renderer renderer(context, scene, ColorConfig::load(), settings);
    const RenderResult sharp = renderer.render();
    RenderSettings near = settings, far = settings, curved = settings;
    near.camera.lens = lens_at(0.7, 30), far.camera.lens = lens_at(1, 30);
    curved.camera.optics = {.projection = Projection::fisheye, .fisheye_fov = 300};
    for (const RenderSettings* other : {&far, &near, &curved}) {
        expect_same(renderer.render(*other), render(context, scene, *other));
        expect_same(renderer.render(settings), sharp);
    }
    settings.primary = PrimaryVisibility::raster;
    Renderer rasters(context, scene, ColorConfig::load(), settings);
    EXPECT_NE(error_message([&] { rasters.render(far); }).find("depth of field"), std::string::npos);
    EXPECT_NO_THROW(rasters.render(settings));
}

}  // namespace
}  // namespace halflight::test
