// Tests that left-out parts would have contributed exactly nothing: with all parts built, pictures are equal bit for
// bit.
#include <gtest/gtest.h>

#include <filesystem>
#include <set>
#include <string>

#include "engine/io/gltf/gltf.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

class LeftOutTest : public GpuTest {
  protected:
    void check(const Scene& scene, const RenderSettings& settings) {
        RenderSettings keeping = settings;
        keeping.kept = Kept::everything();
        const RenderResult lean = render(context, scene, settings);
        const RenderResult kept = render(context, scene, keeping);
        expect_same(kept, lean);
        // All parts are built, so more memory is used. The list of left-out parts holds only alternatives.
        EXPECT_GT(kept.stats.gpu_bytes, lean.stats.gpu_bytes);
        EXPECT_GT(lean.stats.left_out.size(), kept.stats.left_out.size());
        static const std::set<std::string> not_requested = {
            "there are no bounces",
            "there is one bounce",
            "its preview mode is off",
            "path reuse is off",
            "no clamp is set",
            "there is one camera ray per sample",
            "neither mattes nor light groups were requested",
            "no light groups were requested",
            "no object is one",
            "culling by tiles is off",
            "no variance was requested",
            "no denoising was requested",
            "no adaptive sampling was requested",
            "no depth of field was requested",
            "neither another projection nor stereo was requested",
            "neither albedo nor normal was requested",
            "there is no directional light beside others, or another choice was asked for"};
        for (const LeftOut& part : kept.stats.left_out)
            EXPECT_TRUE(part.what == "environment map" || part.what == "light tree" || part.what == "every light" ||
                        part.what == "double precision for slivers" || part.what == "mip levels" ||
                        part.what == "rasterization" || not_requested.contains(part.fact))
                << part.what << ": " << part.fact;
    }

    /// Renders enough samples that `automatic` tries tiles.
    void check(const Scene& scene) {
        const Camera camera = scene.cameras.empty() ? framing_camera(scene) : scene.cameras.front();
        RenderSettings settings = small_settings(camera, 48, 32, 6, 4);
        settings.estimator.reuse = Reuse::sixteen;
        settings.aovs.clear();
        for (const AovInfo& aov : known_aovs())
            if (aov.in_all()) settings.aovs.emplace_back(aov.name);
        check(scene, settings);
    }
};

TEST_F(LeftOutTest, ChangesNothingOfOurScenes) {
    int count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(HALFLIGHT_SOURCE_DIR "/scenes")) {
        if (entry.path().extension() != ".glb") continue;
        SCOPED_TRACE(entry.path().filename());
        check(load_gltf(entry.path()));
        ++count;
    }
    EXPECT_GE(count, 7);
}

TEST_F(LeftOutTest, ChangesNothingOfSurfaces) {
    const std::pair<const char*, Scene> scenes[] = {
        {"textures", textured_scene()}, {"curtains", curtain_scene()}, {"instances", instanced_scene()}};
    for (const auto& [name, scene] : scenes) {
        SCOPED_TRACE(name);
        check(scene);
    }
}

TEST_F(LeftOutTest, ChangesNothingOfTransmissionThatPassesNoLight) {
    // Metals transmit nothing, so their rays start at the smooth surface. A black solid only reflects, like a solid.
    Material metal = metal_material(vec3(0.9f, 0.7f, 0.5f), 0.3f), black = glass_material(0.1f);
    metal.transmission = 1, metal.diffuse_transmission = 0.5f, metal.thickness = 1;
    black.base_color = {0, 0, 0, 1};
    for (const Material& material : {metal, black}) {
        SCOPED_TRACE(material.metallic);
        Scene scene;
        scene.environment.color = vec3(0.4f, 0.5f, 0.6f);
        add_quad(scene, add_material(scene, diffuse_material(vec3(0.7f))), {-3, -1, -3}, {0, 0, 6}, {6, 0, 0});
        add_smooth_ball(scene, add_material(scene, material), vec3(0), 1);
        add_quad(scene, add_material(scene, light_material(vec3(4))), {-1, 3, -1}, {2, 0, 0}, {0, 0, 2});
        scene.cameras = {look_at_camera({0.3, 1.2, 4}, dvec3(0), {0, 1, 0}, 0.7)};
        check(scene);
    }
}

TEST_F(LeftOutTest, ChangesNothingWhereThereIsNoLightToSample) {
    // Only paths reach the light, so there is indirect light but no light sampling.
    Scene scene = cornell_box(diffuse_material(vec3(0.5f)));
    for (Material& m : scene.materials) {
        m.unlit = m.emission != vec3(0);
        m.emission = vec3(0);
    }
    check(scene);
}

TEST_F(LeftOutTest, ChangesNothingOfOneLamp) {
    Material plastic = diffuse_material({0.7f, 0.5f, 0.3f});
    plastic.specular = 1, plastic.roughness = 0.4f;
    Scene scene = closed_box(plastic);
    PunctualLight& lamp = scene.lights.emplace_back();
    lamp.type = LightType::point;
    lamp.position = {0.2, 0.5, -0.1};
    lamp.intensity = vec3(3);
    scene.cameras = {camera_in_box()};
    check(scene, small_settings(scene.cameras.front(), 64, 64, 4, 4));
}

TEST_F(LeftOutTest, ChangesNothingOfManyLights) {
    Scene scene = cornell_box(metal_material(vec3(0.9f, 0.7f, 0.5f), 0.2f));
    for (int i = 0; i < 10; ++i) {
        const float x = 0.15f * static_cast<float>(i) - 0.7f;
        add_quad(scene, add_material(scene, light_material(vec3(2))), {x, 0.5f, x}, {0.05f, 0, 0}, {0, 0.02f, 0.05f});
    }
    check(scene);
    RenderSettings settings = small_settings(scene.cameras.front(), 32, 32, 2, 4);
    EXPECT_EQ(render(context, scene, settings).stats.estimator.lights, LightChoice::tree);
    settings.estimator.lights = LightChoice::power;
    EXPECT_EQ(render(context, scene, settings).stats.estimator.lights, LightChoice::power);
    check(scene, settings);
}

TEST_F(LeftOutTest, ChangesNothingOfFewLights) {
    Scene scene = cornell_box(metal_material(vec3(0.9f, 0.7f, 0.5f), 0.2f));
    PunctualLight& lamp = scene.lights.emplace_back();
    lamp.position = {0.2, 0.5, -0.1};
    lamp.intensity = vec3(0.5f);
    check(scene);
    const RenderSettings settings = small_settings(scene.cameras.front(), 32, 32, 2, 4);
    EXPECT_EQ(render(context, scene, settings).stats.estimator.lights, LightChoice::all);
}

TEST_F(LeftOutTest, ChangesNothingOfSlivers) {
    Scene scene = cornell_box(metal_material(vec3(0.9f, 0.7f, 0.5f), 0.2f));
    add_quad(scene, add_material(scene, diffuse_material(vec3(0.8f))), {-0.9f, -0.5f, 0.7f}, {1.8f, 0.4f, 0},
             {0, 1e-5f, 0});
    check(scene);
}

TEST_F(LeftOutTest, ChangesNothingOfShortPaths) {
    const Scene scene = cornell_box(metal_material(vec3(0.9f, 0.7f, 0.5f), 0.2f));
    for (const int bounces : {0, 1}) {
        SCOPED_TRACE(bounces);
        check(scene, small_settings(scene.cameras.front(), 32, 32, 2, bounces));
    }
}

}  // namespace
}  // namespace halflight::test
