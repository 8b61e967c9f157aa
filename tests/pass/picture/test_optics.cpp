// Tests pictures of projections and of two eyes: against the oracle, at seams and poles, and what must not change them.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "engine/core/image_tools.h"
#include "engine/reference/reference.h"
#include "renderer/focus.h"
#include "renderer/frame_constants.h"
#include "tests/pass/picture/cornell_test.h"
#include "tests/support/image_tests.h"

namespace halflight::test {
namespace {

/// Optics that the tests below look through, each with the size of a picture.
struct View {
    Optics optics;
    ivec2 image;
};
const View kViews[] = {
    {{.projection = Projection::panorama}, {64, 32}},
    {{.projection = Projection::fisheye, .fisheye_fov = 300}, {48, 40}},
    {{.projection = Projection::equisolid, .fisheye_fov = 180}, {40, 48}},
    {{.projection = Projection::panorama, .stereo = Stereo::over_under, .eye_distance = 0.1}, {48, 48}},
    {{.projection = Projection::fisheye, .stereo = Stereo::right, .eye_distance = 0.1, .convergence = 0.5}, {32, 32}},
    {{.stereo = Stereo::side_by_side, .eye_distance = 0.1, .convergence = 0.6}, {64, 32}},
};

class OpticsTest : public CornellTest {
  protected:
    static Camera camera_of(const Optics& optics) {
        Camera camera = look_at_camera({0.2, 0.1, 0.3}, {-0.1, -0.2, -1}, {0, 1, 0}, 1);
        camera.optics = optics;
        return camera;
    }
    static RenderSettings settings_of(const View& view, int samples, int bounces = 3) {
        return small_settings(camera_of(view.optics), view.image.x, view.image.y, samples, bounces);
    }
    /// Renders with a scene that several pictures share, and with it their kernels.
    RenderResult shown(PreparedScene& scene, const RenderSettings& settings) {
        return Renderer(scene, colors, settings).render();
    }
};

TEST_F(OpticsTest, AgreesWithTheOracle) {
    const Scene scene = cornell_box();
    const ReferenceScene reference(scene);
    PreparedScene prepared(context, scene, {.estimator = {.sampler = SamplePoints::independent}});
    for (const View& view : kViews) {
        constexpr int kSamples = 48;
        RenderSettings settings = settings_of(view, kSamples);
        settings.aovs = {"depth", "position", "normal", "variance"};
        const RenderResult ours = shown(prepared, settings);
        EXPECT_EQ(ours.stats.primary, PrimaryVisibility::traced);
        ReferenceSettings exact;
        exact.width = view.image.x, exact.height = view.image.y;
        exact.camera = settings.camera, exact.bounces = *settings.bounces, exact.samples = 48;
        const ReferenceResult oracle = render_reference(reference, exact);
        Image variance = layer(ours, "variance.R");
        for (float& v : variance.pixels) v *= kSamples;
        EXPECT_TRUE(agree("optics-" + std::to_string(&view - kViews), {rgb(ours.beauty), variance, kSamples},
                          {oracle.beauty, oracle.variance, 48}, {.block = 8, .p_value = 1e-5}));
        int wrong = 0, surfaces = 0;
        for (const auto& [x, y] : pixels_of(view.image)) {
            const float depth = *layer(ours, "Z").at(x, y), expected = *oracle.aovs.depth.at(x, y);
            const bool seen = expected > 0;
            surfaces += seen;
            wrong += seen ? std::abs(depth - expected) > 1e-3f * expected : depth < 1e9f;
        }
        EXPECT_LE(wrong, 3) << "rays beside an edge may differ: " << text(view.optics);
        EXPECT_GT(surfaces, view.image.x * view.image.y / 3);
    }
}

TEST_F(OpticsTest, NothingElseChangesThePicture) {
    for (const int number : {1, 3, 5}) {
        const View& view = kViews[number];
        RenderSettings settings = settings_of(view, 6, 2);
        settings.want_view = true;
        settings.aovs = {"albedo", "normal", "depth", "motion", "ids", "cryptoobject"};
        settings.culling = rays::Culling::off;
        const RenderResult plain = shown(prepared_cornell, settings);
        settings.culling = rays::Culling::raster;
        expect_same(shown(prepared_cornell, settings), plain);
        settings.culling = rays::Culling::compute;
        settings.band_pixels = 1;
        expect_same(shown(prepared_cornell, settings), plain);
        settings.crop = PixelWindow{{13, 9}, {31, 27}};
        RenderResult part = plain;
        part.beauty = part_of(plain.beauty, {13, 9}, {18, 18});
        part.view = part_of(plain.view, {13, 9}, {18, 18});
        for (ExrLayer& l : part.aovs) l.image = part_of(l.image, {13, 9}, {18, 18});
        expect_same(shown(prepared_cornell, settings), part);
    }
}

TEST_F(OpticsTest, PanoramasGoOnBeyondTheirSeam) {
    const Scene scene = shiny_cornell();
    RenderSettings settings = settings_of(kViews[0], 4, 2);
    settings.estimator.sampler = SamplePoints::sobol;
    settings.aovs = {"depth", "normal"};
    const RenderResult whole = render(context, scene, settings);
    settings.overscan = 8;
    const RenderResult wide = render(context, scene, settings);
    const Image& inner = layer(whole, "Z");
    const Image& outer = layer(wide, "Z");
    for (const auto& [x, y] : pixels_of({8, 32})) {
        EXPECT_NEAR(*outer.at(x, y + 8), *inner.at(56 + x, y), 1e-4) << "left of the seam";
        EXPECT_NEAR(*outer.at(72 + x, y + 8), *inner.at(x, y), 1e-4) << "right of the seam";
    }
    for (int y = 0; y < 8; ++y)  // above a pole, the picture goes on at the opposite longitude
        for (int x = 0; x < 64; ++x) EXPECT_NEAR(*outer.at(x + 8, y), *inner.at((x + 32) % 64, 7 - y), 1e-4);
}

TEST_F(OpticsTest, MotionFollowsTheProjection) {
    const Scene scene = closed_box(diffuse_material(vec3(0.5f)));
    PreparedScene prepared(context, scene);
    for (const View& view : kViews) {
        RenderSettings settings = settings_of(view, 1, 0);
        settings.aovs = {"motion", "position"};
        Camera before = settings.camera;
        before.camera_to_world = glm::rotate(before.camera_to_world, -0.2, dvec3(0, 1, 0));
        before.camera_to_world[3] += dvec4(0.1, -0.05, 0.02, 0);
        settings.previous_camera = before;
        const RenderResult result = shown(prepared, settings);
        const CameraPlaces earlier(before, view.image);
        const Image &motion = layer(result, "motion.X"), &position = layer(result, "position.X");
        int moved = 0;
        for (const auto& [x, y] : pixels_of(view.image)) {
            const float* p = position.at(x, y);
            const dvec3 point(p[0], p[1], p[2]);
            if (point == dvec3(0)) continue;
            const auto place = earlier.place(point, {x, y});
            if (!place) continue;
            const dvec2 way = earlier.shorter(dvec2(x + 0.5, y + 0.5) - *place);
            // Near poles and rims, directions are far less precise than pixels.
            if (std::abs(way.x) > 12) continue;
            EXPECT_NEAR(motion.at(x, y)[0], way.x, 2e-2) << text(view.optics) << " " << x << ", " << y;
            EXPECT_NEAR(motion.at(x, y)[1], way.y, 2e-2) << text(view.optics) << " " << x << ", " << y;
            moved += glm::length(way) > 0.5;
        }
        EXPECT_GT(moved, 200) << text(view.optics);
        settings.previous_camera = settings.camera;
        const RenderResult still = shown(prepared, settings);
        const std::vector<float>& motions = layer(still, "motion.X").pixels;
        for (std::size_t i = 0; i < motions.size(); ++i)
            EXPECT_EQ(motions[i], 0) << text(view.optics) << ", value " << i;
    }
}

TEST_F(OpticsTest, EyesInOnePictureAreThoseOfTheirOwnPictures) {
    const Scene scene = cornell_box();
    View view{{.projection = Projection::panorama, .stereo = Stereo::over_under}, {64, 64}};
    RenderSettings both = settings_of(view, 1, 0);
    both.aovs = {"depth"};
    const Image pair = layer(render(context, scene, both), "Z");
    for (const Stereo eye : {Stereo::left, Stereo::right}) {
        view.optics.stereo = eye, view.image.y = 32;
        RenderSettings one = settings_of(view, 1, 0);
        one.aovs = {"depth"};
        const Image alone = layer(render(context, scene, one), "Z");
        EXPECT_TRUE(same_bits(part_of(pair, {0, eye == Stereo::left ? 0 : 32}, {64, 32}), alone));
    }
}

TEST_F(OpticsTest, TheDenoiserTakesNothingFromTheOtherEye) {
    View view{{.stereo = Stereo::left}, {32, 32}};
    RenderSettings one = settings_of(view, 4, 2);
    one.denoise = true;
    const RenderResult alone = shown(prepared_cornell, one);
    ASSERT_TRUE(alone.stats.denoised);
    for (const Stereo both : {Stereo::over_under, Stereo::side_by_side}) {
        view = {{.stereo = both}, both == Stereo::over_under ? ivec2(32, 64) : ivec2(64, 32)};
        RenderSettings settings = settings_of(view, 4, 2);
        settings.denoise = true;
        EXPECT_TRUE(same_bits(part_of(shown(prepared_cornell, settings).beauty, {0, 0}, {32, 32}), alone.beauty))
            << name(both);
    }
}

TEST_F(OpticsTest, DenoisedPanoramasHaveNoSeam) {
    const Scene scene = closed_box(diffuse_material(vec3(0.5f)));
    PreparedScene prepared(context, scene);
    RenderSettings settings = settings_of({{.projection = Projection::panorama}, {64, 32}}, 4, 4);
    settings.denoise = true;
    const Image seen = shown(prepared, settings).beauty;
    const auto step = [&](int left, int right) {
        double sum = 0;
        for (int y = 4; y < 28; ++y)
            for (int c = 0; c < 3; ++c) {
                const double a = double(seen.at(left, y)[c]), b = double(seen.at(right, y)[c]);
                sum += std::abs(a - b) / (a + b + 1e-9);
            }
        return sum;
    };
    double most = 0;
    for (int x = 0; x + 1 < 64; ++x) most = std::max(most, step(x, x + 1));
    EXPECT_LE(step(63, 0), most);
}

TEST_F(OpticsTest, AFocusIsAPointOfTheWholePicture) {
    const Scene scene = cornell_box();
    PreparedScene prepared(context, scene);
    const auto focus = [&](const Optics& optics, const ivec2& image, const dvec2& point) {
        RenderSettings settings = settings_of({optics, image}, 1, 0);
        settings.camera.lens = {.aperture = 30, .focus = {.kind = Focus::Kind::point, .point = point}};
        return find_focus(prepared, colors, settings, settings.camera);
    };
    const Optics pair{.stereo = Stereo::side_by_side, .eye_distance = 1e-6};
    for (const dvec2 place : {dvec2(0.5, 0.5), dvec2(0.1, 0.6), dvec2(0.9, 0.9)}) {
        const double plain = focus({}, {32, 32}, place);
        for (const double eye : {0.0, 0.5})
            EXPECT_NEAR(focus(pair, {64, 32}, {0.5 * place.x + eye, place.y}), plain, 1e-4 * plain);
    }
    EXPECT_GT(std::abs(focus({}, {32, 32}, {0.1, 0.6}) - focus({}, {32, 32}, {0.5, 0.5})), 0.05);
}

TEST_F(OpticsTest, OutsideOfTheImageCircleIsNothing) {
    Scene scene = pyramids();
    scene.environment.color = vec3(1);
    View view{{.projection = Projection::fisheye}, {48, 32}};
    for (const bool transparent : {false, true}) {
        RenderSettings settings = settings_of(view, 4, 2);
        settings.camera = camera_on_pyramids();
        settings.camera.optics = view.optics;
        settings.transparent = transparent;
        settings.estimator.camera = CameraRays::four;
        const RenderResult result = render(context, scene, settings);
        for (const auto& [x, y] : pixels_of({48, 32})) {
            const double r = glm::length(dvec2(x + 0.5, y + 0.5) - dvec2(24, 16));
            const float* p = result.beauty.at(x, y);
            if (r > 16.8) {
                EXPECT_EQ(vec3(p[0], p[1], p[2]), vec3(0)) << x << ", " << y;
            }
            if (r < 15.2 && !transparent) {
                EXPECT_GT(p[0] + p[1] + p[2], 0) << x << ", " << y;
            }
        }
    }
}

}  // namespace
}  // namespace halflight::test
