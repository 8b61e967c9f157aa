// Tests that left-out parts would have contributed exactly nothing: with all parts built, or one part alone, pictures
// are equal bit for bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <string>

#include "engine/io/gltf/gltf.h"
#include "engine/io/ies.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"
#include "tests/support/ies_files.h"

namespace halflight::test {
namespace {

using Names = std::set<std::string>;

Names left_out(const RenderResult& result) {
    Names names;
    for (const LeftOut& part : result.stats.left_out) names.insert(part.what);
    return names;
}

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
        const Names still = left_out(kept);
        for (const std::string& name : keepable)
            EXPECT_FALSE(still.contains(name) && settings.bounces > 1) << name << " cannot be kept";
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

    /// Keeps, one at a time, the left-out parts of the scene that are in `todo`, and removes them from it.
    void keep_each(const Scene& scene, std::vector<std::string>& todo) {
        RenderSettings settings = small_settings(scene.cameras.front(), 32, 32, 3, 3);
        settings.pictures = 1;  // one picture, so that tile lists are left out
        std::erase(settings.aovs, "variance");
        const RenderResult lean = render(context, scene, settings);
        for (const std::string& item : left_out(lean)) {
            if (std::ranges::find(todo, item) == todo.end()) continue;
            SCOPED_TRACE(item);
            settings.kept = Kept({item});
            const RenderResult kept = render(context, scene, settings);
            expect_same(kept, lean);
            EXPECT_FALSE(left_out(kept).contains(item));
            std::erase(todo, item);
        }
    }

    const std::vector<std::string> keepable = keepable_names();
};

TEST_F(LeftOutTest, EachPartChangesNothing) {
    Scene glowing = tilted_quad();  // each triangle of this emissive quad is a light
    glowing.meshes[0].triangles.resize(1);
    glowing.meshes[0].triangle_material.resize(1);
    glowing.cameras = {camera_on_quad()};
    Scene metal = tilted_quad();
    metal.materials[0] = metal_material({0.9f, 0.7f, 0.4f}, 0.3f);
    metal.environment.color = {0.5f, 0.7f, 0.9f};
    metal.cameras = {camera_on_quad()};
    Scene unlit = tilted_quad();
    unlit.materials[0].unlit = true;
    unlit.cameras = {camera_on_quad()};
    std::vector<std::string> todo = keepable;
    for (const Scene& scene : {cornell_box(), glowing, metal, unlit}) keep_each(scene, todo);
    EXPECT_EQ(todo, std::vector<std::string>()) << "no scene leaves these out";
}

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
    for (const Scene& scene : {textured_scene(), curtain_scene(), instanced_scene()}) check(scene);
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
    scene.light_profiles = {read_ies("test.ies", washer().text())};
    scene.lights[0].profile = 0;
    check(scene, small_settings(scene.cameras.front(), 32, 32, 4, 4));
}

TEST_F(LeftOutTest, ChangesNothingOfManyAndFewLights) {
    const Scene box = cornell_box(metal_material(vec3(0.9f, 0.7f, 0.5f), 0.2f));
    Scene many = box, few = box;
    for (int i = 0; i < 10; ++i) {
        const float x = 0.15f * static_cast<float>(i) - 0.7f;
        add_quad(many, add_material(many, light_material(vec3(2))), {x, 0.5f, x}, {0.05f, 0, 0}, {0, 0.02f, 0.05f});
    }
    PunctualLight& lamp = few.lights.emplace_back();
    lamp.position = {0.2, 0.5, -0.1};
    lamp.intensity = vec3(0.5f);
    RenderSettings settings = small_settings(box.cameras.front(), 32, 32, 2, 4);
    EXPECT_EQ(render(context, few, settings).stats.estimator.lights, LightChoice::all);
    EXPECT_EQ(render(context, many, settings).stats.estimator.lights, LightChoice::tree);
    check(few);
    check(many);
    settings.estimator.lights = LightChoice::power;
    EXPECT_EQ(render(context, many, settings).stats.estimator.lights, LightChoice::power);
    check(many, settings);
}

TEST_F(LeftOutTest, ChangesNothingOfSliversAndShortPaths) {
    Scene scene = cornell_box(metal_material(vec3(0.9f, 0.7f, 0.5f), 0.2f));
    for (const int bounces : {0, 1}) {
        SCOPED_TRACE(bounces);
        check(scene, small_settings(scene.cameras.front(), 32, 32, 2, bounces));
    }
    add_quad(scene, add_material(scene, diffuse_material(vec3(0.8f))), {-0.9f, -0.5f, 0.7f}, {1.8f, 0.4f, 0},
             {0, 1e-5f, 0});
    check(scene);
}

}  // namespace
}  // namespace halflight::test
