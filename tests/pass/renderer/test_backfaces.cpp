// Tests which back faces pictures show.
#include <gtest/gtest.h>

#include <functional>
#include <numeric>

#include "api/halflight/scene_edits.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

Material one_sided(Material material) {
    material.double_sided = false;
    return material;
}

/// Returns a closed room [-1, 1]^3, whose walls face inwards or outwards, around a box that faces outwards.
Scene room(bool inwards) {
    Scene scene;
    const int walls = add_material(scene, one_sided(diffuse_material(vec3(0.7f))));
    const auto wall = [&](const vec3& p, const vec3& u, const vec3& v) {
        inwards ? add_quad(scene, walls, p, u, v) : add_quad(scene, walls, p, v, u);
    };
    wall({-1, -1, -1}, {0, 0, 2}, {2, 0, 0}), wall({-1, 1, -1}, {2, 0, 0}, {0, 0, 2});
    wall({-1, -1, 1}, {0, 2, 0}, {2, 0, 0}), wall({-1, -1, -1}, {2, 0, 0}, {0, 2, 0});
    wall({-1, -1, -1}, {0, 2, 0}, {0, 0, 2}), wall({1, -1, -1}, {0, 0, 2}, {0, 2, 0});
    add_box(scene, add_material(scene, one_sided(diffuse_material({0.8f, 0.3f, 0.2f}))), {-0.5f, -1, -0.5f},
            {0.3f, 0, 0.1f});
    return scene;
}

Camera outside(float near = 0.01f) {
    Camera camera = look_at_camera({0.2, 0.1, 4}, {0.2, 0.1, 0}, {0, 1, 0}, 0.5);
    camera.near_plane = near;
    return camera;
}

void add_sun(Scene& scene) {
    PunctualLight& sun = scene.lights.emplace_back();
    sun.type = LightType::directional, sun.intensity = vec3(3), sun.direction = {0, -1, 0};
    scene.environment.color = vec3(1);
}

class BackfacesTest : public GpuTest {
  protected:
    RenderSettings settings(const Camera& camera, Backfaces backfaces = Backfaces::automatic) const {
        RenderSettings s = small_settings(camera, 32, 32, 2, 4);
        s.aovs.insert(s.aovs.end(), {"ids", "depth", "cryptoobject"});
        s.backfaces = backfaces;
        return s;
    }
    RenderResult picture(const Scene& scene, const RenderSettings& settings) {
        return render(context, scene, settings);
    }
    /// Returns the mean radiance of diffuse surfaces.
    static double light(const RenderResult& result) {
        return mean_of_pixels(layer(result, "direct_diffuse.R"), 0).value +
               mean_of_pixels(layer(result, "indirect_diffuse.R"), 0).value;
    }
};

TEST_F(BackfacesTest, ARoomIsSeenThroughItsWallAsIfTheCameraWereInside) {
    Scene scene = room(true);
    PunctualLight& lamp = scene.lights.emplace_back();
    lamp.intensity = vec3(2), lamp.position = {0.3, 0.6, 0.2};
    add_sun(scene);
    for (const PrimaryVisibility primary : {PrimaryVisibility::raster, PrimaryVisibility::traced}) {
        RenderSettings through = settings(outside()), clipped = settings(outside(3.001f), Backfaces::show);
        through.primary = clipped.primary = primary;
        const RenderResult a = picture(scene, through), b = picture(scene, clipped);
        EXPECT_EQ(a.beauty.pixels, b.beauty.pixels) << name(primary);
        for (std::size_t i = 0; i < a.aovs.size(); ++i) {
            const std::vector<float>&x = a.aovs[i].image.pixels, &y = b.aovs[i].image.pixels;
            const auto same = std::inner_product(x.begin(), x.end(), y.begin(), 0, std::plus(), std::equal_to());
            EXPECT_LE(int(x.size()) - same, 1) << a.aovs[i].name << ": a ray may meet the edge of two triangles";
        }
        EXPECT_GT(light(a), 0.05);
    }
}

TEST_F(BackfacesTest, TheSunStaysOutsideOfAClosedRoom) {
    for (const bool inwards : {true, false}) {
        Scene scene = room(inwards);
        add_sun(scene);
        std::vector<Camera> cameras = {look_at_camera({0.9, 0.8, 0.9}, {-0.3, -0.5, -0.1}, {0, 1, 0}, 0.4)};
        if (inwards) cameras.push_back(outside());
        for (const Camera& camera : cameras) {
            EXPECT_EQ(light(picture(scene, settings(camera))), 0) << inwards;
            EXPECT_EQ(light(picture(scene, settings(camera, Backfaces::cull))) > 0.05, !inwards);
        }
    }
}

TEST_F(BackfacesTest, RasterAndRaysSeeTheSameFaces) {
    Scene scene = pyramids();
    for (Material& m : scene.materials) m.double_sided = false;
    for (const Backfaces backfaces : {Backfaces::automatic, Backfaces::show}) {
        RenderSettings s = settings(camera_on_pyramids(), backfaces);
        s.width = s.height = 96;
        s.primary = PrimaryVisibility::raster;
        const RenderResult raster = picture(scene, s);
        s.primary = PrimaryVisibility::traced;
        const RenderResult traced = picture(scene, s);
        const Image &a = layer(raster, "Z"), &b = layer(traced, "Z");
        int differ = 0;
        for (std::size_t i = 0; i < a.pixels.size(); ++i) differ += std::abs(a.pixels[i] - b.pixels[i]) > 1e-3f;
        EXPECT_LT(differ, 10) << name(backfaces);
    }
}

TEST_F(BackfacesTest, MirrorsAndPanesPassThemToo) {
    const auto radiance = [&](const Material& mirror, Backfaces backfaces) {
        Scene scene;
        scene.environment.color = vec3(0, 0, 1);
        add_quad(scene, add_material(scene, mirror), {-1, -1, -1}, {2, 0, 2}, {0, 2, 0});  // shows what is at -x
        Material red = one_sided({});
        red.unlit = true, red.base_color = vec4(1, 0, 0, 1);
        add_quad(scene, add_material(scene, red), {-2, -3, -3}, {0, 0, 6}, {0, 6, 0});  // faces -x
        RenderSettings s = settings(look_at_camera({0, 0, 1.5}, {0, 0, 0}, {0, 1, 0}, 0.3), backfaces);
        const RenderResult result = picture(scene, s);
        return vec3(*result.beauty.at(16, 16), result.beauty.at(16, 16)[1], result.beauty.at(16, 16)[2]);
    };
    const Material mirror = one_sided(metal_material(vec3(1), 0)), rough = one_sided(metal_material(vec3(1), 0.3f));
    EXPECT_LT(radiance(mirror, Backfaces::automatic).r, 0.01f);
    EXPECT_GT(radiance(mirror, Backfaces::automatic).b, 0.9f);
    EXPECT_GT(radiance(mirror, Backfaces::show).r, 0.9f);
    EXPECT_GT(radiance(rough, Backfaces::automatic).r, 0.5f);
    EXPECT_LT(radiance(rough, Backfaces::cull).r, 0.01f);
}

TEST_F(BackfacesTest, EditsOfDoubleSidedCount) {
    const Scene scene = room(true);
    SceneEdits edits;
    edits.materials = {{"0", {{"double_sided", {1}}}, ""}};
    Scene edited = scene;
    apply(edits, edited);
    const RenderSettings s = settings(outside());
    PreparedScene prepared(context, scene);
    const ColorConfig colors = ColorConfig::load();
    const RenderResult through = Renderer(prepared, colors, s).render();
    prepared.update(edited);
    const RenderResult wall = Renderer(prepared, colors, s).render();
    expect_same(wall, picture(edited, s));
    EXPECT_NEAR(*layer(wall, "Z").at(16, 16), 3, 1e-4);
    EXPECT_GT(*layer(through, "Z").at(16, 16), 3.5);
    prepared.update(scene);
    expect_same(Renderer(prepared, colors, s).render(), through);
}

TEST_F(BackfacesTest, ScenesWithoutThemLeaveTheTestsOut) {
    Scene scene = room(true);
    const auto left_out = [&](Backfaces backfaces) {
        const RenderResult result = picture(scene, settings(outside(), backfaces));
        std::string facts;
        for (const LeftOut& part : result.stats.left_out)
            if (part.what == "tests of back faces") facts += part.fact;
        return facts;
    };
    EXPECT_EQ(left_out(Backfaces::automatic), "");
    EXPECT_NE(left_out(Backfaces::show), "");
    for (Material& m : scene.materials) m.double_sided = true;
    EXPECT_NE(left_out(Backfaces::automatic), "");
}

}  // namespace
}  // namespace halflight::test
