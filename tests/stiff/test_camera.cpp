// Tests extreme cameras and picture sizes in scenes of constant radiance.
#include <algorithm>
#include <cmath>

#include "tests/stiff/stiff.h"

namespace halflight::test {
namespace {

class View : public StiffTest {
  protected:
    /// Returns a closed room of emission 1, under a sky of 10^6 that must not leak in.
    static Scene room() {
        Material glowing = diffuse_material(vec3(0.5f));
        glowing.emission = vec3(1);
        Scene scene = closed_box(glowing);
        scene.environment.color = vec3(1e6f);
        return scene;
    }
    RenderResult emission(const Scene& scene, const Camera& camera, int width, int height) {
        return picture(scene, small_settings(camera, width, height, 16, 0));
    }
    static constexpr const char* kInside = "exact: every ray within the room ends on its walls";
};

TEST_F(View, PositionsOfTheCamera) {
    const auto seen = [&](const dvec3& from, const dvec3& to, double fov) {
        return pixels_other_than(emission(room(), look_at_camera(from, to, {0, 1, 0}, fov), 64, 64).beauty, 1);
    };
    expect("camera within a wall, looking in", seen({-1, 0.1, 0.2}, {0, 0, 0}, 1.5), 0, "pixels", kInside);
    expect("camera in a corner, looking in", seen({-1, -1, -1}, {0, 0, 0}, 0.5), 0, "pixels", kInside);
    expect("camera 10^-5 m from a wall, looking along it", seen({-1 + 1e-5, 0.1, 0.2}, {-1 + 1e-5, 0.1, 1}, 1), 0,
           "pixels", kInside);
    expect("camera 10^-5 m from a wall, looking at it", seen({-1 + 1e-5, 0.1, 0.2}, {-2, 0.1, 0.2}, 1), 0, "pixels",
           kInside);
    // The near plane clips the walls.
    const Camera close = look_at_camera({-100 + 1e-4, 10, 20}, {-200, 10, 20}, {0, 1, 0}, 1);
    expect("camera 10^-4 m from a wall of a room of 200 m, looking at it",
           pixels_other_than(emission(scaled(room(), 100), close, 64, 64).beauty, 1), 0, "pixels", kInside);
    Scene card;
    add_quad(card, add_material(card, light_material(vec3(1))), {-5e-4f, -5e-4f, -1e-5f}, {1e-3f, 0, 0}, {0, 1e-3f, 0});
    add_quad(card, add_material(card, light_material(vec3(3))), {-1e7f, -1e7f, -1e7f}, {2e7f, 0, 0}, {0, 2e7f, 0});
    expect("camera 10^-5 m from a card of 1 mm before a wall of 10^7 m",
           pixels_other_than(emission(card, look_at_camera({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 1), 64, 64).beauty, 1), 0,
           "pixels", "exact: the card covers the view");

    Scene inside = room();
    add_box(inside, add_material(inside, diffuse_material(vec3(0))), vec3(-0.2f), vec3(0.3f));
    const Camera camera = look_at_camera({0.1, 0, 0.05}, {1, 0.2, 0}, {0, 1, 0}, 2);
    expect("camera within a solid black block", pixels_other_than(picture(inside, camera, 32, 16, 4).beauty, 0), 0,
           "pixels", "exact: closed and black");
}

TEST_F(View, FieldsOfView) {
    for (const double degrees : {0.001, 179.0}) {
        // A wall of radiance 1 is left of the centre, one of radiance 3 right of it. They meet between two columns.
        Scene scene;
        const float size = degrees < 1 ? 1.0f : 1e4f;
        add_quad(scene, add_material(scene, light_material(vec3(1))), {-size, -size, -1}, {size, 0, 0},
                 {0, 2 * size, 0});
        add_quad(scene, add_material(scene, light_material(vec3(3))), {0, -size, -1}, {size, 0, 0}, {0, 2 * size, 0});
        const Camera camera = look_at_camera({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, degrees * kPi / 180);
        const Image seen = emission(scene, camera, 64, 64).beauty;
        double wrong = 0;
        for (int y = 0; y < 64; ++y)
            for (int x = 0; x < 64; ++x) wrong += *seen.at(x, y) != (x < 32 ? 1 : 3);
        expect(fmt::format("an edge in the middle at {} degrees", degrees), wrong, 0, "pixels",
               "exact: the edge is between two columns");
        expect_both(fmt::format("closed room at {} degrees", degrees), room(),
                    look_at_camera({0.3, 0.2, 0.5}, {-1, -0.4, -0.6}, {0, 1, 0}, degrees * kPi / 180), 24, 16, 3,
                    1.875);
    }
}

TEST_F(View, PictureSizes) {
    for (const ivec2& size : {ivec2(1, 1), ivec2(1, 4096), ivec2(4096, 1), ivec2(17, 3)}) {
        const Scene scene = room();
        expect(fmt::format("picture of {} x {}: pixels of the wrong radiance", size.x, size.y),
               pixels_other_than(emission(scene, camera_in_box(), size.x, size.y).beauty, 1), 0, "pixels", kInside);
        RenderSettings settings = small_settings(camera_in_box(), size.x, size.y, size.x * size.y < 100 ? 2048 : 16, 3);
        expect_mean(fmt::format("picture of {} x {}: light of 3 bounces", size.x, size.y),
                    mean_of(picture(scene, settings)), 1.875);
    }
}

TEST_F(View, Orthographic) {
    Scene scene;
    add_quad(scene, add_material(scene, light_material(vec3(1))), {-0.75f, 0, -0.25f}, {0, 0, 0.5f}, {1.25f, 0, 0});
    for (const double scale : {1e-6, 1.0, 1e6}) {
        Camera camera = spot_camera(dvec3(0), {0, 1, 0}, 2);
        Scene whole = scene;
        whole.cameras = {camera};
        whole = scaled(whole, scale);
        RenderSettings settings = small_settings(whole.cameras[0], 32, 32, 16, 0);
        // Rasterizers snap corners to 1/256 pixel, so a ray closer than that to a corner may miss it.
        settings.primary = PrimaryVisibility::traced;
        const RenderResult seen = picture(whole, settings);
        double covered = 0;
        for (int y = 0; y < 32; ++y)
            for (int x = 0; x < 32; ++x) covered += *seen.beauty.at(x, y) / (32 * 32.0);
        expect(fmt::format("share of an orthographic picture of {} m that a card covers", 2 * scale),
               std::abs(covered - 1.25 * 0.5 / 4), 0, "of the picture", "exact: its edges are edges of pixels");
    }
    Camera inside = look_at_camera({0.5, 0.1, 0.2}, {-1, 0.1, 0.2}, {0, 1, 0}, 1);
    inside.orthographic = true;
    inside.ortho_height = 1.5;
    expect("orthographic camera in a closed room", pixels_other_than(emission(room(), inside, 32, 32).beauty, 1), 0,
           "pixels", kInside);
}

TEST_F(View, Lenses) {
    const auto with_lens = [](Camera camera, double focus, double millimetres) {
        camera.lens = {.aperture = millimetres, .focus = {.kind = Focus::Kind::distance, .distance = focus}};
        return camera;
    };
    const Camera middle = look_at_camera({0, 0.05, 0}, {-0.4, 0.1, -1}, {0, 1, 0}, 1);
    for (const double focus : {1e-6, 0.3, 1e9, double(INFINITY)}) {
        const Camera camera = with_lens(middle, focus, 1800);
        expect(fmt::format("aperture of 1.8 m in a room of 2 m, focus at {} m", focus),
               pixels_other_than(emission(room(), camera, 32, 32).beauty, 1), 0, "pixels", kInside);
        expect_mean(fmt::format("light of 3 bounces through it, focus at {} m", focus),
                    mean_of(picture(room(), camera, 24, 64, 3)), 1.875);
    }
    expect_mean("light of 3 bounces through it, oracle",
                mean_of(render_oracle(room(), with_lens(middle, 0.3, 1800), 16, 64, 3)), 1.875);
    // The wall is nearer than the plane of focus, and the lens touches it.
    const Camera close = with_lens(look_at_camera({-1 + 1e-3, 0.1, 0.2}, {-2, 0.1, 0.2}, {0, 1, 0}, 1), 5, 100);
    expect("lens of 100 mm, 1 mm from a wall", pixels_other_than(emission(room(), close, 32, 32).beauty, 1), 0,
           "pixels", kInside);

    // Two cards: a near one over the left half of a far one.
    Scene cards;
    add_quad(cards, add_material(cards, light_material(vec3(2))), {-1, -1, -1}, {1, 0, 0}, {0, 2, 0});
    add_quad(cards, add_material(cards, light_material(vec3(1))), {-9, -9, -4}, {18, 0, 0}, {0, 18, 0});
    const Camera camera = look_at_camera({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 0.5);
    RenderSettings settings = small_settings(camera, 32, 32, 64, 0);
    settings.primary = PrimaryVisibility::traced;
    const Image sharp = picture(cards, settings).beauty;
    settings.camera = with_lens(camera, 2, 1e-6);
    expect("aperture of 1 nm: pixels unlike those of a pinhole",
           share_beyond(picture(cards, settings).beauty, sharp, 1e-6), 0, "of the pixels",
           "the blur is 10^-8 pixels wide");
    settings.camera = with_lens(camera, 2, 40);
    const Image blurred = picture(cards, settings).beauty;
    for (const double scale : {1e-6, 1e6}) {
        Scene whole = cards;
        whole.cameras = {camera};
        whole = scaled(whole, scale);
        settings.camera = with_lens(whole.cameras[0], 2 * scale, 40 * scale);
        expect(fmt::format("blurred cards, scaled by {}", scale),
               share_beyond(picture(whole, settings).beauty, blurred, 1e-6), 0.005, "of the pixels",
               "rounding moves few samples across the edge");
    }
    Scene far = cards;
    far.cameras = {camera};
    far = moved(far, {0x1p20, -0x1p19, 0x1p21});
    settings.camera = with_lens(far.cameras[0], 2, 40);
    expect("blurred cards, 2^21 m from the origin", share_beyond(picture(far, settings).beauty, blurred, 1e-6), 0.005,
           "of the pixels", "geometry is relative to the middle of the scene");
}

TEST_F(View, Projections) {
    const Camera middle = look_at_camera({0.1, 0.05, 0}, {-0.4, 0.1, -1}, {0, 1, 0}, 1);
    /// Returns the number of pixels other than 1 within the image circle, and of those other than 0 outside of it.
    const auto wrong = [&](const Scene& scene, Camera camera, const Optics& optics, int width, int height) {
        camera.optics = optics;
        const Image image = emission(scene, camera, width, height).beauty;
        double count = 0;
        for (int y = 0; y < height; ++y) {
            for (int x = 0; x < width; ++x) {
                const double side = std::min(width, height) / 2.0;
                const double r = glm::length(dvec2(x + 0.5 - width / 2.0, y + 0.5 - height / 2.0));
                const bool rim = optics.is_fisheye() && std::abs(r - side) < 1,
                           inside = !optics.is_fisheye() || r < side;
                count += !rim && *image.at(x, y) != (inside ? 1 : 0);
            }
        }
        return count;
    };
    constexpr const char* kCircle =
        "exact: every ray within the room ends on its walls, and none starts outside of the circle";
    for (const Projection projection : {Projection::fisheye, Projection::equisolid})
        for (const double fov : {0.01, 1.0, 180.0, 359.9, 360.0})
            expect(fmt::format("{} of {} degrees in a closed room", name(projection), fov),
                   wrong(room(), middle, {.projection = projection, .fisheye_fov = fov}, 40, 32), 0, "pixels", kCircle);
    const Camera up = look_at_camera({0.1, 0.05, 0}, {0.1, 1, 0}, {0, 0, 1}, 1);
    for (const auto& [camera, word] : {std::pair(middle, "level"), std::pair(up, "looking up")})
        for (const ivec2& size : {ivec2(64, 32), ivec2(1, 1), ivec2(1, 64), ivec2(64, 1)})
            expect(fmt::format("panorama of {}x{} pixels in a closed room, {}", size.x, size.y, word),
                   wrong(room(), camera, {.projection = Projection::panorama}, size.x, size.y), 0, "pixels", kInside);
    for (const double eyes : {1e-6, 0.065, 1.7})
        for (const double meet : {0.0, 1.0001 * eyes, 1e9})
            expect(fmt::format("panorama of eyes {} m apart in a room of 2 m, converging at {:g} m", eyes, meet),
                   wrong(room(), middle,
                         {.projection = Projection::panorama,
                          .stereo = Stereo::over_under,
                          .eye_distance = eyes,
                          .convergence = meet},
                         32, 32),
                   0, "pixels", kInside);
    for (const double scale : {1e-6, 1e6}) {
        Scene whole = room();
        whole.cameras = {middle};
        whole = scaled(whole, scale);
        expect(
            fmt::format("panorama of a room scaled by {}", scale),
            wrong(whole, whole.cameras[0],
                  {.projection = Projection::panorama, .stereo = Stereo::left, .eye_distance = 0.065 * scale}, 64, 32),
            0, "pixels", kInside);
    }
    Scene far = room();
    far.cameras = {middle};
    far = moved(far, {0x1p20, -0x1p19, 0x1p21});
    expect("panorama 2^21 m from the origin", wrong(far, far.cameras[0], {.projection = Projection::panorama}, 64, 32),
           0, "pixels", kInside);
    Camera around = middle;
    around.optics.projection = Projection::panorama;
    expect_mean("light of 3 bounces in a panorama", mean_of(picture(room(), small_settings(around, 32, 16, 64, 3))),
                1.875);
}

}  // namespace
}  // namespace halflight::test
