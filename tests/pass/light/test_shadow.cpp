// Tests direct light: quadratures, occluders, and the split with rays that hit the light.
#include "passes/light/shadow.h"
#include "passes/surface/gbuffer.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "engine/core/statistics.h"
#include "shaders/shared/path_state.h"
#include "tests/pass/light/closed_forms.h"
#include "tests/pass/picture/pixels.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/pass/stage.h"

namespace halflight::test {
namespace {

const dvec3 kUp(0, 1, 0);

/// Rectangle of constant radiance.
struct RectangleLight {
    vec3 corner, u, v;
    vec3 radiance{3, 5, 7};
};

class ShadowTest : public PassTest {
  protected:
    struct Sample {
        std::vector<SurfaceRecord> surfaces;
        std::vector<shared::DirectLight> light;
        std::vector<shared::uint> occluded;
    };
    Sample shadow(Stage& stage) {
        graph::Graph graph;
        const SceneView view = stage.view(graph);
        const GBuffer g = add_gbuffer(graph, view);
        const DirectLightEstimate d = add_shadow(graph, view, g);
        graph.output(g.surfaces);
        graph.output(d.light);
        graph.output(d.occluded);
        run(graph);
        return {unpack_surfaces(executor.read<vec4>(g.surfaces), stage.buffers().needs()),
                executor.read<shared::DirectLight>(d.light), executor.read<shared::uint>(d.occluded)};
    }
};

struct Components {
    dvec3 diffuse{0}, glossy{0};
};

/// Returns the radiance towards wo at the origin of a floor under the light, by the midpoint rule.
Components quadrature(const RectangleLight& light, const reference::Bsdf& bsdf) {
    constexpr int kSteps = 300;
    const dvec3 u(light.u), v(light.v), face = glm::cross(u, v);
    Components sum;
    for (int i = 0; i < kSteps; ++i) {
        for (int j = 0; j < kSteps; ++j) {
            const dvec3 p = dvec3(light.corner) + (i + 0.5) / kSteps * u + (j + 0.5) / kSteps * v;
            const double square = glm::dot(p, p);
            const dvec3 wi = p / std::sqrt(square);
            const double solid_angle = std::abs(glm::dot(wi, face)) / square / kSteps / kSteps;
            const reference::Bsdf::Value f = bsdf.evaluate(wi);
            sum.diffuse += f.diffuse * solid_angle * dvec3(light.radiance);
            sum.glossy += f.glossy * solid_angle * dvec3(light.radiance);
        }
    }
    return sum;
}

// Both sampling techniques contribute to lights of medium size. One light is above the point, the other one beside it.
const RectangleLight kLights[] = {{{-0.3f, 1.2f, -0.4f}, {0.9f, 0, 0}, {0, 0, 1}},
                                  {{0.8f, 0.1f, -0.3f}, {0, 1, 0}, {0, 0, 0.7f}}};

struct Case {
    const char* name;
    Material material;
};
std::vector<Case> materials() {
    std::vector<Case> cases{{"diffuse", diffuse_material({0.2f, 0.5f, 0.8f})},
                            {"metal", metal_material({0.9f, 0.6f, 0.3f}, 0.5f)}};
    Material m = metal_material({0.2f, 0.5f, 0.8f}, 0.6f);
    m.metallic = 0;
    cases.push_back({"dielectric", m});
    m.clearcoat = 0.7f;
    m.clearcoat_roughness = 0.5f;
    cases.push_back({"coated", m});
    return cases;
}

TEST_F(ShadowTest, BothTechniquesSumToTheIntegral) {
    const dvec3 wo = glm::normalize(dvec3(-1, 0.9, 0.2));
    for (const Case& c : materials()) {
        for (RectangleLight light : kLights) {
            for (const bool half_hidden : {false, true}) {
                SCOPED_TRACE(fmt::format("{}{}", c.name, half_hidden ? ", half hidden" : ""));
                Scene scene = floor_scene(c.material, 2);
                add_quad(scene, add_material(scene, light_material(light.radiance)), light.corner, light.u, light.v);
                if (half_hidden) {
                    // A card halfway to the light hides the second half of v. It is larger than its part of the light.
                    add_quad(scene, add_material(scene, diffuse_material(vec3(0))),
                             0.5f * (light.corner + 0.5f * light.v - 0.2f * light.u), 0.7f * light.u, 0.5f * light.v);
                    light.v *= 0.5f;
                }
                const RenderResult r =
                    render(context, scene, small_settings(spot_camera(dvec3(0), wo, 1e-3), 64, 64, 32, 1));
                const Components expected = quadrature(light, oracle_bsdf(c.material, wo));
                for (int i = 0; i < 3; ++i) {
                    for (const bool is_diffuse : {true, false}) {
                        const MeanValue m =
                            mean_of_pixels(layer(r, is_diffuse ? "direct_diffuse.R" : "direct_glossy.R"), i);
                        const double value = is_diffuse ? expected.diffuse[i] : expected.glossy[i];
                        EXPECT_NEAR(m.value, value, 4 * m.error + 2e-4 * value) << (is_diffuse ? "diffuse" : "glossy");
                        EXPECT_LE(m.error, 0.01 * value);
                    }
                }
            }
        }
    }
}

TEST_F(ShadowTest, ConstantEnvironment) {
    Scene scene = floor_scene(diffuse_material({0.2f, 0.5f, 0.8f}));
    scene.environment.color = {1, 2, 3};
    Stage stage(programs, scene, spot_camera(dvec3(0), kUp, 1e-3), {160, 160});
    const Sample s = shadow(stage);
    const RenderResult whole = render(context, scene, small_settings(spot_camera(dvec3(0), kUp, 1e-3), 64, 64, 16, 1));
    for (int i = 0; i < 3; ++i) {
        RunningMoments sampled;
        for (std::size_t path = 0; path < s.light.size(); ++path)
            sampled.add(s.occluded[path] == 0 ? s.light[path].diffuse[i] : 0);
        const double reflected = scene.materials[0].base_color[i] * scene.environment.color[i];
        // The light's density is 1 / 4 pi, the surface's mu / pi. The expected value is the integral of 2 mu / (1 + 16
        // mu^2) over mu in [0, 1].
        const double share = reflected * std::log(17.0) / 16;
        EXPECT_NEAR(sampled.mean(), share, 4 * sampled.standard_error() + 1e-4 * share) << "light sampling alone";
        EXPECT_LE(sampled.standard_error(), 0.01 * share);
        const MeanValue m = mean_of_pixels(whole.beauty, i);
        EXPECT_NEAR(m.value, reflected, 4 * m.error + 1e-5);
        EXPECT_LE(m.error, 0.01 * reflected);
    }
}

// --- Lights without extent: one sample is exact -----------------------------------------------------------------

/// Returns a light at a fixed place; a spot light or a sun shines in direction (-0.2, -1, z).
PunctualLight light_of(LightType type, float z = 0) {
    PunctualLight l;
    l.type = type;
    l.intensity = {3, 5, 7};
    l.position = {0.4, 1.5, -0.3};
    l.direction = glm::normalize(vec3(-0.2f, -1, z));
    l.inner_cone = 0.3f;
    l.outer_cone = 0.6f;
    return l;
}

TEST_F(ShadowTest, PunctualLightsAreExactAtEveryPixel) {
    for (const PunctualLight& light :
         {light_of(LightType::point), light_of(LightType::spot, 0.1f), light_of(LightType::directional, 0.7f)}) {
        Scene scene = floor_scene(diffuse_material({0.2f, 0.5f, 0.8f}));
        scene.lights = {light};
        Stage stage(programs, scene, look_at_camera({0, 3, 2}, {0, 0, 0}, kUp, 1.1), {48, 32});
        const Sample s = shadow(stage);
        int lit = 0;
        for (const auto& [x, y] : pixels_of({48, 32})) {
            const std::size_t path = stage.path(x, y);
            const dvec3 position = dvec3(s.surfaces[path].position) + stage.trace_tables().origin;
            const dvec3 expected = dvec3(scene.materials[0].base_color) / kPi * irradiance(light, position, kUp);
            // At the cone's edge, cosines have errors of 2^-22. They are scaled by 1 / 0.13 and by a value of up to
            // 4.
            for (int i = 0; i < 3; ++i)
                EXPECT_NEAR(s.light[path].diffuse[i], expected[i], 2e-5 * expected[i] + 1e-5) << x << ", " << y;
            if (expected.x > 0) {
                EXPECT_EQ(s.occluded[path], 0u);
                ++lit;
            }
        }
        EXPECT_GT(lit, light.type == LightType::spot ? 100 : 1500);
        if (light.type == LightType::spot) {
            EXPECT_LT(lit, 1000);
        }
    }
}

TEST_F(ShadowTest, ALightBelowTheFloorHasNoEffect) {
    Scene scene = floor_scene(metal_material(vec3(1), 0.8f));
    scene.lights = {light_of(LightType::point)};
    scene.lights[0].position.y = -1e-3;
    Stage stage(programs, scene, look_at_camera({0, 3, 2}, {0, 0, 0}, kUp, 1.1), {48, 32});
    for (const shared::DirectLight& l : shadow(stage).light) EXPECT_EQ(l.diffuse + l.glossy, vec3(0));
}

TEST_F(ShadowTest, PointLightsCastSharpShadows) {
    Scene scene = floor_scene(diffuse_material(vec3(0.5f)));
    scene.lights = {light_of(LightType::point)};
    scene.lights[0].position = {0, 2, 0};
    // The occluder is halfway up and covers x > 1/2 of the floor; its far edge is outside the view.
    add_quad(scene, add_material(scene, diffuse_material(vec3(0))), {0.25f, 1, -5}, {0, 0, 10}, {5, 0, 0});
    Camera camera = look_at_camera({0, 0.9, 0}, {0, 0, 0}, {0, 0, -1}, 1);
    camera.orthographic = true;
    camera.ortho_height = 2;
    Stage stage(programs, scene, camera, {64, 64});
    const Sample s = shadow(stage);
    for (const auto& [x, y] : pixels_of(ivec2(64))) {
        const double at = (x + 0.5) / 32 - 1;
        EXPECT_EQ(s.occluded[stage.path(x, y)], at > 0.5 ? 1u : 0u) << x << ", " << y;
    }
}

}  // namespace
}  // namespace halflight::test
