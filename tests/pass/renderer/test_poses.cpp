// Tests renderers of animated scenes: pictures depend only on the reference pose and the current pose.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

using rays::Culling;
using rays::HierarchyCounts;

class Poses : public GpuTest {
  protected:
    /// Returns the scene with the first instance's mesh bent by `t` and the last instance moved.
    static Scene posed(Scene scene, float t) {
        Mesh& mesh = scene.meshes[static_cast<std::size_t>(scene.instances.front().mesh)];
        mesh.deforms = true;
        for (vec3& p : mesh.positions) p.y += 0.2f * t * std::sin(3 * p.x + p.z);
        Instance& last = scene.instances.back();
        last.moves = true;
        last.object_to_world = glm::translate(dmat4(1), dvec3(0.1, 0, 0.2) * double(t)) * last.object_to_world;
        return scene;
    }
    static RenderSettings settings(const Scene& scene, Culling culling) {
        RenderSettings s = all_settings(scene, 24, 32, 6);
        s.culling = culling;
        s.band_pixels = 32 * 16;
        return s;
    }

    ColorConfig colors = ColorConfig::load();
};

TEST_F(Poses, PicturesDoNotDependOnEarlierPoses) {
    using enum Culling;
    // State of tracing methods depends on geometry alone, which the instanced scene has of all kinds.
    const std::pair<Scene, std::vector<Culling>> rows[] = {{shiny_cornell(), {off, automatic}},
                                                           {textured_scene(), {off, automatic}},
                                                           {instanced_scene(), {off, compute, raster, automatic}}};
    for (const auto& [scene, cullings] : rows) {
        const float times[] = {0, 1, 3, 1};
        std::vector<RenderResult> alone;
        for (const float t : times) {
            Renderer renderer(context, posed(scene, 0), colors, settings(scene, Culling::off));
            renderer.update(posed(scene, t));
            alone.push_back(renderer.render());
        }
        expect_same(alone[1], alone[3]);
        EXPECT_FALSE(same_bits(alone[0].beauty, alone[1].beauty));
        for (const Culling culling : cullings) {
            Renderer renderer(context, posed(scene, 0), colors, settings(scene, culling));
            for (std::size_t i = 0; i < alone.size(); ++i) {
                SCOPED_TRACE(fmt::format("{}, pose {}", rays::name(culling), i));
                if (i > 0) renderer.update(posed(scene, times[i]));
                expect_same(renderer.render(), alone[i]);
            }
        }
    }
}

TEST_F(Poses, HierarchyUpdatesAreReported) {
    const Scene scene = shiny_cornell();
    Renderer renderer(context, posed(scene, 0), colors, settings(scene, Culling::off));
    EXPECT_EQ(renderer.render().stats.hierarchies, (HierarchyCounts{.built = 3})) << "the two that move, and the rest";
    EXPECT_EQ(renderer.render().stats.hierarchies, (HierarchyCounts{.kept = 3})) << "no other pose since";
    renderer.update(posed(scene, 1));
    EXPECT_EQ(renderer.render().stats.hierarchies, (HierarchyCounts{.kept = 1, .refitted = 2}));
    renderer.update(posed(scene, 1));
    EXPECT_EQ(renderer.render().stats.hierarchies, (HierarchyCounts{.kept = 3}));
}

/// Expects a renderer that changes from one scene to another to make the picture of a new renderer.
void expect_fresh(gpu::Context& context, const ColorConfig& colors, const Scene& from, const Scene& to,
                  const RenderSettings& settings) {
    Renderer updated(context, from, colors, settings);
    updated.render();
    updated.update(to);
    Renderer fresh(context, to, colors, settings);
    const RenderResult expected = fresh.render(), found = updated.render();
    expect_same(found, expected);
    EXPECT_EQ(found.stats.left_out, expected.stats.left_out) << "the pose determines the needs";
}

TEST_F(Poses, LightsMaterialsAndNeedsFollowThePose) {
    const Scene scene = textured_scene();
    Scene other = scene;
    for (std::size_t i = 0; i < other.materials.size(); ++i) {
        Material& m = other.materials[i];
        m.roughness = 0.3f;
        m.clearcoat = i == 0 ? 0.5f : 0.0f;  // one of the two has clearcoat textures
        m.transmission = 0;
        m.emission = vec3(i == 1 ? 2.0f : 0.0f);
    }
    other.environment.color = vec3(0.5f);
    other.lights.push_back({.name = "lamp", .position = dvec3(0, 3, 2)});
    expect_fresh(context, colors, scene, other, settings(scene, Culling::off));
    expect_fresh(context, colors, other, scene, settings(scene, Culling::compute));
    Scene turned = scene;
    for (Material& m : turned.materials) {
        for (TextureRef* t : {&m.base_color_texture, &m.metallic_roughness_texture, &m.normal_texture,
                              &m.emission_texture, &m.clearcoat_texture})
            t->uv_transform = {vec2(0, -1), vec2(1.5f, 0), vec2(0.25f, 0.5f)};
        m.alpha_cutoff = 0.75f;
        m.normal_scale = 0.5f;
        m.ior = 2;
    }
    for (Mesh& mesh : turned.meshes)
        for (vec4& tangent : mesh.tangents) tangent.w = -tangent.w;
    expect_fresh(context, colors, scene, turned, settings(scene, Culling::compute));
    Scene dark = scene;
    dark.environment = {};
    dark.lights.clear();
    for (Material& m : dark.materials) m.emission = vec3(0);
    expect_fresh(context, colors, scene, dark, settings(scene, Culling::off));
    expect_fresh(context, colors, dark, scene, settings(scene, Culling::off));
}

TEST_F(Poses, PreviewModesContinue) {
    const Scene scene = shiny_cornell();
    RenderSettings s = settings(scene, Culling::off);
    s.preview = {.cache = true, .filter = true};
    Scene other = scene;
    other.lights.push_back({.name = "lamp", .position = dvec3(0, 3, 2)});  // point lights need other shaders
    expect_fresh(context, colors, scene, other, s);
    Scene dimmer = scene;
    for (Material& m : dimmer.materials) m.base_color *= 0.5f;
    expect_fresh(context, colors, scene, dimmer, s);
}

TEST_F(Poses, InstancesMayAppearAndDisappear) {
    const Scene scene = instanced_scene();
    Scene fewer = scene;
    fewer.instances.resize(scene.instances.size() / 2);
    for (const Culling culling : {Culling::compute, Culling::raster}) {
        Renderer renderer(context, scene, colors, settings(scene, culling)),
            other(context, scene, colors, settings(scene, culling));
        const RenderResult all = renderer.render();
        renderer.update(fewer);
        other.update(posed(scene, 1));
        other.render();
        other.update(fewer);
        const RenderResult some = renderer.render();
        expect_same(some, other.render());
        EXPECT_FALSE(same_bits(some.beauty, all.beauty));
        renderer.update(scene);
        expect_same(renderer.render(), all);
    }
}

}  // namespace
}  // namespace halflight::test
