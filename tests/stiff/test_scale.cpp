// Tests that pictures depend neither on the unit of length nor on the position of the origin.
#include <cmath>

#include "tests/stiff/stiff.h"

namespace halflight::test {
namespace {

class Scale : public StiffTest {
  protected:
    /// Returns a room with an area light, a lamp, diffuse and glossy surfaces, a rotated block and a tilted block.
    static Scene room() {
        Scene scene = cornell_box(metal_material({0.9f, 0.7f, 0.4f}, 0.3f));
        PunctualLight& lamp = scene.lights.emplace_back();
        lamp.position = {0.5, 0.25, 0.75};
        lamp.intensity = vec3(0.5f);
        return scene;
    }
    /// Returns a box whose coordinates are multiples of 1/16. They remain so when vertices move by an integer below
    /// 2^20.
    static Scene exact_box(float by) {
        Scene scene;
        const int white = add_material(scene, diffuse_material(vec3(0.5f)));
        const int light = add_material(scene, light_material(vec3(4)));
        const vec3 o(by, -by, by);
        add_box(scene, white, o + vec3(-1), o + vec3(1));
        add_box(scene, white, o + vec3(-0.5f, -1, -0.25f), o + vec3(0.25f, 0.125f, 0.5f));
        add_quad(scene, light, o + vec3(-0.25f, 0.9375f, -0.25f), {0.5f, 0, 0}, {0, 0, 0.5f});
        Camera& camera = scene.cameras.emplace_back();
        camera.camera_to_world[3] = dvec4(dvec3(o) + dvec3(0.25, 0.25, 0.9375), 1);
        camera.vertical_fov = 1.2;
        return scene;
    }
    RenderResult of(const Scene& scene, rays::Culling culling = rays::Culling::automatic) {
        RenderSettings settings = small_settings(scene.cameras[0], 48, 48, 8, 4);
        settings.culling = culling;
        return picture(scene, settings);
    }
    const char* const same_bits = "exact: a power of two scales every operation without rounding";
};

TEST_F(Scale, PowersOfTwo) {
    const RenderResult one = of(room());
    for (const int power : {-20, -10, 10, 20})
        expect(fmt::format("room scaled by 2^{} ({:.0e})", power, std::exp2(power)),
               pixels_that_differ(of(scaled(room(), std::exp2(power))).beauty, one.beauty), 0, "pixels differ",
               same_bits);
    for (const rays::Culling culling : {rays::Culling::compute, rays::Culling::raster})
        expect(fmt::format("room scaled by 2^20, culling {}", name(culling)),
               pixels_that_differ(of(scaled(room(), 0x1p20), culling).beauty, one.beauty), 0, "pixels differ",
               "exact: and culling never changes a hit");
}

TEST_F(Scale, PowersOfTen) {
    const RenderResult one = of(room());
    for (const double factor : {1e-6, 1e-3, 1e3, 1e6}) {
        const RenderResult other = of(scaled(room(), factor));
        expect(fmt::format("room scaled by {:.0e}: pixels that changed", factor),
               share_beyond(other.beauty, one.beauty, 1e-4), 0.02, "of all pixels",
               "corners round anew, 2^-24 of the room; 32 paths of a pixel cross some 10 edges' rounding each");
    }
}

TEST_F(Scale, Translations) {
    const RenderResult here = of(room());
    for (const dvec3& by : {dvec3(1e6, 0, 0), dvec3(1e6, -3e5, 2e6)})
        expect(fmt::format("room moved by {}, {}, {}: pixels that changed", by.x, by.y, by.z),
               share_beyond(of(moved(room(), by)).beauty, here.beauty, 1e-4), 0.001, "of all pixels",
               "places in doubles keep 2^-31 m here, a hundredth of what the tables' floats do");
    const RenderResult box = of(exact_box(0));
    for (const dvec3& by : {dvec3(1e6), dvec3(-0x1p30, 0x1p30, 1e6)})
        expect(fmt::format("box moved by {}, {}, {}", by.x, by.y, by.z),
               pixels_that_differ(of(moved(exact_box(0), by)).beauty, box.beauty), 0, "pixels differ",
               "exact: multiples of 1/16 below 2^31 fit a double");
    expect("box of vertices at 10^6 from their mesh's origin",
           pixels_that_differ(of(exact_box(1e6f)).beauty, box.beauty), 0, "pixels differ",
           "exact: multiples of 1/16 fit a float, and the tables have an origin of their own");
}

TEST_F(Scale, DetailBesideExtents) {
    // A cube of 1 mm stands on a floor under a sun, with hills at a distance of 10^7 m.
    const auto at = [this](float floor, float hills, const dvec3& where) {
        Scene scene;
        const int white = add_material(scene, diffuse_material(vec3(0.5f)));
        const auto place = [&](int instance) {
            scene.instances[static_cast<std::size_t>(instance)].object_to_world[3] = dvec4(where, 1);
        };
        place(add_quad(scene, white, {-floor / 2, 0, -floor / 2}, {0, 0, floor}, {floor, 0, 0}));
        place(add_box(scene, white, {-0.0005f, 0, -0.0005f}, {0.0005f, 0.001f, 0.0005f}));
        if (hills > 0)
            for (const float side : {-hills, hills})
                add_box(scene, white, {side, 0, side}, {1.01f * side, 1e4f, 1.01f * side});
        PunctualLight& sun = scene.lights.emplace_back();
        sun.type = LightType::directional;
        sun.direction = glm::normalize(vec3(1, -1, 0.25f));
        sun.intensity = vec3(3);
        scene.cameras = {
            look_at_camera(where + dvec3(0.001, 0.004, 0.005), where + dvec3(0.0003, 0, 0), {0, 1, 0}, 0.7)};
        scene.cameras[0].near_plane = 1e-4;  // the automatic near plane would be 2^-20 of the visible depth
        return picture(scene, small_settings(scene.cameras[0], 48, 48, 16, 1)).beauty;
    };
    const Image alone = at(1, 0, dvec3(0));
    const char* reason = "edges of cube and shadow cross a twentieth of the pixels, and floats move some";
    expect("1 mm cube, floor of 1 m, hills at 10^7 m", share_beyond(at(1, 1e7f, dvec3(0)), alone, 1e-3), 0.02,
           "of all pixels", reason);
    expect("the same 3 10^6 m from the middle", share_beyond(at(1, 1e7f, dvec3(3e6, 0, -2e6)), alone, 1e-3), 0.02,
           "of all pixels", reason);
    expect("1 mm cube, floor of 100 m", share_beyond(at(100, 0, dvec3(0)), alone, 1e-3), 0.1, "of all pixels",
           "rays leave a triangle at 2^-21 of its size, here 2^-4 of the cube, so that the shadow's foot is lost");
}

}  // namespace
}  // namespace halflight::test
