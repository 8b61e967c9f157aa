// Tests projections, eyes and lenses as pure functions: camera rays, their inverse, known directions, parallax, the
// aperture of an f-number, and how settings and scenes combine.
#include "engine/core/optics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "api/halflight/camera.h"
#include "api/halflight/statistics.h"
#include "engine/core/view_transform.h"
#include "engine/settings/denoiser_windows.h"
#include "engine/settings/render_settings.h"
#include "renderer/frame_constants.h"
#include "tests/unit/renderer/refusal.h"

namespace halflight {
namespace {

constexpr Projection kProjections[] = {Projection::camera, Projection::panorama, Projection::fisheye,
                                       Projection::equisolid};
const ivec2 kImage(2000, 1200);

Camera camera_with(const Optics& optics) {
    Camera camera;  // at the origin, looking along -Z
    camera.optics = optics;
    return camera;
}

struct Ray {
    dvec3 origin;
    dvec3 direction;  // unit vector
    bool seen;
};

/// Returns the ray through a place of the picture, as shaders/lib/camera.glsl composes it, in camera coordinates.
Ray ray_at(const Camera& camera, const ivec2& image, const dvec2& place, const ivec2& pixel) {
    const shared::Optics o = shader_optics(camera, image);
    const bool second = shared::shows_second_eye(o, pixel, image);
    const vec2 plane = shared::plane_of_place(o, second, vec2(place), image);
    const vec3 eye = shared::eye_place(o, shared::eye_of(o, second), plane);
    const vec3 along = shared::seen_direction(o, plane) - o.toe_in * eye;
    return {dvec3(eye), glm::normalize(dvec3(along)), shared::in_image_circle(o, plane)};
}
Ray ray_at(const Camera& camera, const dvec2& place) {
    return ray_at(camera, kImage, place, ivec2(place));
}

TEST(Optics, PlacesAreTheInverseOfRays) {
    std::mt19937 random(3);
    const auto real = [&](double a, double b) { return std::uniform_real_distribution(a, b)(random); };
    int found = 0;
    for (int i = 0; i < 20000; ++i) {
        Optics optics{.projection = kProjections[i % 4]};
        optics.fisheye_fov = i % 3 == 0 ? 360 : real(1, 359);
        optics.stereo = stereo_layouts()[std::size_t(i / 4) % stereo_layouts().size()];
        if (i % 5 < 2) optics.convergence = real(0.2, 10);
        const Camera camera = camera_with(optics);
        const dvec2 place(real(0, kImage.x), real(0, kImage.y));
        const Ray ray = ray_at(camera, place);
        if (!ray.seen) continue;
        const dvec3 point = ray.origin + ray.direction * std::exp(real(0, 6));
        const auto again = CameraPlaces(camera, kImage).place(point, ivec2(place));
        ASSERT_TRUE(again.has_value()) << text(optics);
        // Near a pole of a panorama and at the rim of a full fisheye, many places have almost the same direction.
        const Ray there = ray_at(camera, kImage, *again, ivec2(place));
        EXPECT_LT(glm::length(glm::normalize(point - there.origin) - ray.direction), 4e-6) << text(optics);
        const double slack = optics.projection == Projection::panorama
                                 ? 1e-3 / std::max(std::hypot(ray.direction.x, ray.direction.z), 1e-4)
                             : optics.is_fisheye() ? 4e-3 / std::max(std::hypot(ray.direction.x, ray.direction.y), 1e-4)
                                                   : 2e-3;
        const dvec2 way = CameraPlaces(camera, kImage).shorter(*again - place);
        if (optics.projection == Projection::panorama || ray.direction.z < 0) {
            EXPECT_LT(glm::length(way), slack) << text(optics) << " at " << place.x << ", " << place.y;
        }
        ++found;
    }
    EXPECT_GT(found, 12000);
}

TEST(Optics, KnownDirections) {
    struct Case {
        Optics optics;
        dvec2 share;  // place, relative to the picture's size
        dvec3 direction;
    };
    const Optics panorama{.projection = Projection::panorama};
    // Half of the radius: 45 degrees, or for equal areas 2 asin(sin(45 degrees) / 2).
    const double angle = 2 * std::asin(std::sqrt(0.5) / 2);
    std::vector<Case> cases{
        {panorama, {0.5, 0.5}, {0, 0, -1}},
        {panorama, {0.75, 0.5}, {1, 0, 0}},
        {panorama, {0.25, 0.5}, {-1, 0, 0}},
        {panorama, {0, 0.5}, {0, 0, 1}},
        {panorama, {1, 0.5}, {0, 0, 1}},
        {panorama, {0.3, 0}, {0, 1, 0}},
        {panorama, {0.9, 1}, {0, -1, 0}},
        {{.projection = Projection::fisheye}, {0.75, 0.5}, {std::sqrt(0.5), 0, -std::sqrt(0.5)}},
        {{.projection = Projection::equisolid}, {0.5, 0.25}, {0, std::sin(angle), -std::cos(angle)}}};
    for (const Projection projection : {Projection::fisheye, Projection::equisolid}) {
        const Optics half{.projection = projection, .fisheye_fov = 180};
        cases.push_back({half, {0.5, 0.5}, {0, 0, -1}});
        cases.push_back({half, {1, 0.5}, {1, 0, 0}});
        cases.push_back({half, {0.5, 0}, {0, 1, 0}});
        cases.push_back({{.projection = projection, .fisheye_fov = 360}, {0, 0.5}, {0, 0, 1}});
    }
    for (const auto& [optics, share, direction] : cases) {
        const Ray ray = ray_at(camera_with(optics), {1000, 1000}, share * 1000.0, ivec2(share * 999.0));
        EXPECT_LT(glm::length(ray.direction - direction), 1e-6) << text(optics) << " " << share.x << ", " << share.y;
    }
}

TEST(Optics, EqualAreasHaveEqualSolidAngles) {
    // Midpoint rule over the image circle: the solid angle of a fisheye's circle is 2 pi (1 - cos(fov / 2)).
    for (const double fov : {1.0, 180.0, 300.0}) {
        const Camera camera = camera_with({.projection = Projection::equisolid, .fisheye_fov = fov});
        const shared::Optics o = shader_optics(camera, kImage);
        const double area = kPi * double{o.circle} * double{o.circle};
        EXPECT_NEAR(area, 2 * kPi * (1 - std::cos(glm::radians(fov) / 2)), 1e-6 * area);
    }
}

TEST(Optics, TheImageCircleTouchesTheShorterSide) {
    for (const Projection projection : {Projection::fisheye, Projection::equisolid}) {
        const Camera camera = camera_with({.projection = projection, .fisheye_fov = 200});
        EXPECT_TRUE(ray_at(camera, {1000, 0.01}).seen);
        EXPECT_TRUE(ray_at(camera, {400.01, 600}).seen);
        EXPECT_FALSE(ray_at(camera, {399.9, 600}).seen);
        EXPECT_FALSE(ray_at(camera, {1, 1}).seen);
    }
    EXPECT_TRUE(ray_at(camera_with({.projection = Projection::panorama}), {0, 0}).seen);
}

/// Returns the way of a point in the picture from the right eye to the left one, pixels to the right.
double parallax(Optics optics, const dvec3& point) {
    optics.stereo = Stereo::left;
    const auto left = CameraPlaces(camera_with(optics), kImage).place(point, {0, 0});
    optics.stereo = Stereo::right;
    const auto right = CameraPlaces(camera_with(optics), kImage).place(point, {0, 0});
    EXPECT_TRUE(left && right);
    return left->x - right->x;
}

TEST(Optics, ParallaxOfKnownPoints) {
    constexpr double kEyes = 0.065;
    const Camera camera;
    const double pixels = kImage.y / (2 * std::tan(camera.vertical_fov / 2));  // per unit at distance 1
    const Optics panorama{.projection = Projection::panorama}, fisheye{.projection = Projection::fisheye};
    for (const double distance : {0.5, 2.0, 50.0}) {
        const dvec3 point(0.1 * distance, -0.2 * distance, -distance);
        EXPECT_NEAR(parallax({}, point), pixels * kEyes / distance, 2e-3) << "parallel eyes";
        EXPECT_NEAR(parallax({.convergence = 2}, point), pixels * kEyes * (1 / distance - 1 / 2.0), 2e-3);
        // Omnidirectional stereo: the line of sight is a tangent of the circle on which the eyes turn.
        const double level = std::hypot(point.x, point.z), start = std::atan2(point.x, -point.z);
        for (const double azimuth : {start, 1.0, 2.5, -2.0})
            EXPECT_NEAR(parallax(panorama, {level * std::sin(azimuth), point.y, -level * std::cos(azimuth)}),
                        kImage.x / (2 * kPi) * 2 * std::asin(kEyes / 2 / level), 2e-3)
                << "the same in all directions";
        // Two parallel fisheyes; 180 degrees take 1200 pixels.
        EXPECT_NEAR(parallax(fisheye, {0, 0, -distance}), 1200 / kPi * 2 * std::atan(kEyes / 2 / distance), 2e-3);
    }
    for (const Projection projection : kProjections)
        EXPECT_NEAR(parallax({.projection = projection, .convergence = 2}, dvec3(0, 0, -2)), 0, 2e-3)
            << name(projection);
}

TEST(Optics, BothEyesInOnePicture) {
    const Optics one{.projection = Projection::panorama, .stereo = Stereo::right};
    Optics both = one;
    for (const auto& [stereo, image, corner] : {std::tuple{Stereo::over_under, ivec2(2000, 2400), dvec2(0, 1200)},
                                                {Stereo::views, ivec2(2000, 2400), dvec2(0, 1200)},
                                                {Stereo::side_by_side, ivec2(4000, 1200), dvec2(2000, 0)}}) {
        both.stereo = stereo;
        const dvec2 place(700, 300);
        const Ray alone = ray_at(camera_with(one), place);
        const Ray beside = ray_at(camera_with(both), image, place + corner, ivec2(place + corner));
        EXPECT_LT(glm::length(alone.origin - beside.origin), 1e-6);
        EXPECT_LT(glm::length(alone.direction - beside.direction), 1e-6);
        EXPECT_NEAR(eye_aspect(both, image), 2000.0 / 1200, 1e-12);
    }
}

TEST(Optics, PointsWithoutAPlace) {
    EXPECT_FALSE(CameraPlaces(camera_with({.stereo = Stereo::left}), kImage).place({0, 0, 1}, {0, 0}));
    const Camera turning = camera_with({.projection = Projection::panorama, .stereo = Stereo::left});
    EXPECT_FALSE(CameraPlaces(turning, kImage).place({0, 3, 0}, {0, 0})) << "no tangent of the eyes' circle meets it";
    EXPECT_TRUE(CameraPlaces(camera_with({.projection = Projection::panorama}), kImage).place({0, 3, 0}, {0, 0}));
    EXPECT_TRUE(CameraPlaces(camera_with({.projection = Projection::panorama}), kImage).place({0, 0, 1}, {0, 0}));
}

TEST(Optics, WaysAroundAPanoramaAreShort) {
    const CameraPlaces places(camera_with({.projection = Projection::panorama}), {360, 180});
    EXPECT_EQ(places.shorter({359, 3}), dvec2(-1, 3));
    EXPECT_EQ(places.shorter({-200, 0}), dvec2(160, 0));
    EXPECT_EQ(CameraPlaces(camera_with({}), {360, 180}).shorter({359, 3}), dvec2(359, 3));
}

TEST(Optics, EyesAndRingsAreDenoisedApart) {
    const auto windows = [](const Optics& optics, PixelWindow rendered) {
        return denoiser_windows(optics, {200, 100}, rendered);
    };
    using Windows = std::vector<DenoiserWindow>;
    const PixelWindow whole{{0, 0}, {200, 100}}, wide{{-16, -16}, {216, 116}}, lower{{16, 48}, {96, 100}};
    EXPECT_EQ(windows({}, wide), (Windows{{{0, 0}, {232, 132}, 0}}));
    const Optics panorama{.projection = Projection::panorama};
    EXPECT_EQ(windows(panorama, whole), (Windows{{{0, 0}, {200, 100}, kDenoiserReach}}));
    EXPECT_EQ(windows(panorama, wide), (Windows{{{0, 0}, {232, 132}, 0}})) << "the seam is rendered";
    const Optics stacked{.stereo = Stereo::over_under};
    EXPECT_EQ(windows(stacked, wide), (Windows{{{0, 0}, {232, 66}, 0}, {{0, 66}, {232, 66}, 0}}));
    EXPECT_EQ(windows(stacked, lower), (Windows{{{0, 0}, {80, 2}, 0}, {{0, 2}, {80, 50}, 0}}));
    const Optics rings{.projection = Projection::panorama, .stereo = Stereo::side_by_side};
    EXPECT_EQ(windows(rings, whole),
              (Windows{{{0, 0}, {100, 100}, kDenoiserReach}, {{100, 0}, {100, 100}, kDenoiserReach}}));
    EXPECT_EQ(windows(rings, lower), (Windows{{{0, 0}, {80, 52}, 0}}));
    RenderSettings settings;
    settings.width = 320, settings.height = 160, settings.camera.optics = panorama, settings.denoise = true;
    settings.crop = PixelWindow{{100, 60}, {120, 80}};
    EXPECT_EQ(rendered_window(settings, settings.camera.optics), (PixelWindow{{0, 0}, {224, 160}}));
    settings.crop = PixelWindow{{60, 60}, {80, 80}};
    EXPECT_EQ(rendered_window(settings, settings.camera.optics), (PixelWindow{{0, 0}, {320, 160}}))
        << "the filter reaches beyond the seam";
}

TEST(Optics, CamerasWithOptics) {
    Camera own;
    own.aspect = 1.5;
    EXPECT_EQ(with_optics(own, {}).aspect, 1.5);
    EXPECT_EQ(with_optics(own, {.projection = Projection::panorama}).aspect, 2);
    EXPECT_EQ(with_optics(own, {.projection = Projection::equisolid}).aspect, 1);
    EXPECT_EQ(with_optics(own, {.projection = Projection::panorama, .stereo = Stereo::over_under}).aspect, 1);
    EXPECT_EQ(with_optics(own, {.stereo = Stereo::side_by_side}).aspect, 3);
    own.orthographic = true;
    EXPECT_FALSE(with_optics(own, {.projection = Projection::fisheye}).orthographic);
    expect_refusal([&] { with_optics(own, {.stereo = Stereo::left}); }, "render settings: stereo");
    own.lens = {.aperture = 9, .focus = {.kind = Focus::Kind::distance, .distance = 2}};
    expect_refusal([&] { with_optics(own, {.projection = Projection::panorama}); }, "render settings: depth of field");
    expect_refusal([&] { with_optics({}, {.stereo = Stereo::left, .convergence = 0.05}); },
                   "render settings: the eyes");
    expect_refusal([&] { with_optics({}, {.fisheye_fov = 361}); }, "render settings: a fisheye");
    EXPECT_EQ(with_optics({}, {.fisheye_fov = 90, .eye_distance = 1, .convergence = 2}).optics, Optics());
    EXPECT_EQ(text(Optics()), "");
    EXPECT_EQ(text(Optics{.stereo = Stereo::left, .convergence = 3}),
              "stereo left, eyes 0.065 m apart, converging at 3 m");
}

Camera camera_of_50_mm(double aspect) {
    Camera camera;
    camera.vertical_fov = 2 * std::atan(36 / 50.0 / 2 / std::max(aspect, 1.0));
    return camera;
}

TEST(LensValues, ApertureOfAnFNumber) {
    for (const double aspect : {16.0 / 9, 1.0, 0.5}) {
        Camera camera = camera_of_50_mm(aspect);
        camera.lens.fstop = 2;
        EXPECT_NEAR(aperture_radius(camera, aspect), 0.0125, 1e-12) << "50 mm at f/2, whatever the picture's shape";
        camera.lens.sensor = 18;
        EXPECT_NEAR(aperture_radius(camera, aspect), 0.00625, 1e-12);
        camera.lens.aperture = 3;
        EXPECT_NEAR(aperture_radius(camera, aspect), 0.0015, 1e-12) << "the diameter replaces the f-number";
    }
}

TEST(LensValues, SettingsReplaceTheLensOfTheCamera) {
    const Focus at_2{.kind = Focus::Kind::distance, .distance = 2};
    const Camera plain;
    Camera own;
    own.lens = {.fstop = 4, .focus = at_2, .blades = 6};
    EXPECT_EQ(with_lens(plain, {}).lens, Lens());
    EXPECT_EQ(with_lens(plain, {.fstop = 2}).lens, Lens()) << "an f-number alone sets the exposure";
    EXPECT_EQ(with_lens(own, {}).lens, own.lens);
    EXPECT_EQ(with_lens(own, {.fstop = 2}).lens, (Lens{.fstop = 2, .focus = at_2, .blades = 6}));
    EXPECT_EQ(with_lens(own, {.focus = {.kind = Focus::Kind::none}}).lens, Lens());
    EXPECT_EQ(with_lens(own, {.aperture = 9}).lens, (Lens{.fstop = 4, .aperture = 9, .focus = at_2, .blades = 6}));
    EXPECT_EQ(with_lens(plain, {.aperture = 9, .focus = at_2}).lens, (Lens{.aperture = 9, .focus = at_2}));
    expect_refusal([&] { with_lens(plain, {.focus = at_2}); }, "focus: ");
    expect_refusal([&] { with_lens(plain, {.aperture = 9}); }, "aperture: ");
    Camera orthographic;
    orthographic.orthographic = true;
    expect_refusal([&] { with_lens(orthographic, {.fstop = 2, .focus = at_2}); }, "no focal length");
    EXPECT_TRUE(with_lens(orthographic, {.aperture = 2, .focus = at_2}).lens.blurs());
    const Lens lens{.fstop = 2, .focus = {.kind = Focus::Kind::distance, .distance = 1.5}, .blades = 6, .rotation = 10};
    EXPECT_EQ(lens_text(camera_of_50_mm(1.5), lens, {3, 2}),
              "f/2, aperture 25 mm, focus at 1.5 m, 6 blades turned by 10 degrees");
}

TEST(LensValues, AnFNumberBesideAFocusLeavesTheExposureAlone) {
    ViewTransform view;
    view.camera.lens = {.fstop = 2, .focus = {.kind = Focus::Kind::distance, .distance = 2}};
    EXPECT_TRUE(view.metered());
    view.camera.iso = 100;
    EXPECT_FALSE(view.metered()) << "exposure and depth of field share the f-number";
    const float blurred = view.stops();
    view.camera.lens.focus = {};
    EXPECT_EQ(view.stops(), blurred);
}

}  // namespace
}  // namespace halflight
