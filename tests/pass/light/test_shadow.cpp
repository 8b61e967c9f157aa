// Tests direct light: closed forms, quadratures, occluders, and the split with rays that hit the light.
#include "passes/light/shadow.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/core/statistics.h"
#include "engine/reference/bsdf.h"
#include "shaders/shared/path.h"
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
void add_light(Scene& scene, const RectangleLight& l) {
    add_quad(scene, add_material(scene, light_material(l.radiance)), l.corner, l.u, l.v);
}

// Configuration factors of a surface element follow Siegel and Howell, Thermal Radiation Heat Transfer, appendix C.

/// Returns the factor to a rectangle a x b parallel to the element, with one corner straight above it at distance c.
double factor_of_parallel(double a, double b, double c) {
    const double x = a / c, y = b / c, p = std::sqrt(1 + x * x), q = std::sqrt(1 + y * y);
    return (x / p * std::atan(y / p) + y / q * std::atan(x / q)) / (2 * kPi);
}
/// Returns the factor to a rectangle, a high and b wide, that stands perpendicularly on the element's plane. One of its
/// lower corners is the point nearest to the element, at distance c.
double factor_of_perpendicular(double a, double b, double c) {
    const double x = a / b, y = c / b, r = std::sqrt(x * x + y * y);
    return (std::atan(1 / y) - y / r * std::atan(1 / r)) / (2 * kPi);
}

class ShadowTest : public PassTest {
  protected:
    /// Means over all paths and samples of the shadow pass alone.
    struct Found {
        RunningMoments diffuse[3], glossy[3];
    };
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
    Found mean_over(Stage& stage, std::uint32_t samples) {
        Found found;
        for (std::uint32_t i = 0; i < samples; ++i) {
            stage.select_sample(i);
            const Sample s = shadow(stage);
            for (std::size_t path = 0; path < s.light.size(); ++path) {
                const bool visible = s.light[path].diffuse + s.light[path].glossy != vec3(0) && s.occluded[path] == 0;
                for (int c = 0; c < 3; ++c) {
                    found.diffuse[c].add(visible ? s.light[path].diffuse[c] : 0);
                    found.glossy[c].add(visible ? s.light[path].glossy[c] : 0);
                }
            }
        }
        return found;
    }
    static void expect_mean(const RunningMoments& found, double expected, double precision, const char* what) {
        EXPECT_NEAR(found.mean(), expected, 4 * found.standard_error() + 1e-4 * expected) << what;
        EXPECT_LE(found.standard_error(), precision * expected) << what << ": the test says nothing";
    }
};

struct Components {
    dvec3 diffuse{0}, glossy{0};
};

/// Returns the radiance towards wo at the origin of a floor under the light, by the midpoint rule. If
/// `light_sampling_only` is set, the result is multiplied by the power heuristic's weight of light sampling.
Components quadrature(const RectangleLight& light, const reference::Bsdf& bsdf, bool light_sampling_only) {
    constexpr int kSteps = 600;
    const dvec3 u(light.u), v(light.v), face = glm::cross(u, v);
    const double area = glm::length(face);
    Components sum;
    for (int i = 0; i < kSteps; ++i) {
        for (int j = 0; j < kSteps; ++j) {
            const dvec3 p = dvec3(light.corner) + (i + 0.5) / kSteps * u + (j + 0.5) / kSteps * v;
            const double square = glm::dot(p, p);
            const dvec3 wi = p / std::sqrt(square);
            const double solid_angle = std::abs(glm::dot(wi, face)) / square / kSteps / kSteps;
            const double pdf = square / std::abs(glm::dot(wi, face / area)) / area;
            const reference::Bsdf::Value f = bsdf.evaluate(wi);
            const auto weight = [&](double other) {
                return light_sampling_only ? pdf * pdf / (pdf * pdf + other * other) : 1.0;
            };
            sum.diffuse += f.diffuse * weight(f.pdf_diffuse) * solid_angle * dvec3(light.radiance);
            sum.glossy += f.glossy * weight(f.pdf_glossy) * solid_angle * dvec3(light.radiance);
        }
    }
    return sum;
}

reference::Bsdf oracle_bsdf(const Material& m, const dvec3& wo) {
    reference::BsdfParameters p;
    p.base_color = dvec3(m.base_color);
    p.metallic = m.metallic, p.roughness = m.roughness, p.specular = m.specular, p.ior = m.ior;
    p.clearcoat = m.clearcoat, p.clearcoat_roughness = m.clearcoat_roughness;
    return {p, wo, kUp, kUp, kUp};
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

TEST_F(ShadowTest, LightSamplingAloneHasItsShareOfTheIntegral) {
    const dvec3 wo = glm::normalize(dvec3(-1, 0.9, 0.2));
    for (const Case& c : materials()) {
        for (const RectangleLight& light : kLights) {
            SCOPED_TRACE(c.name);
            Scene scene = floor_scene(c.material, 2);
            add_light(scene, light);
            Stage stage(programs, scene, spot_camera(dvec3(0), wo, 1e-3), {128, 128});
            const Found found = mean_over(stage, 4);
            const Components expected = quadrature(light, oracle_bsdf(c.material, wo), true);
            for (int i = 0; i < 3; ++i) {
                expect_mean(found.diffuse[i], expected.diffuse[i], 0.01, "diffuse");
                expect_mean(found.glossy[i], expected.glossy[i], 0.01, "glossy");
            }
        }
    }
}

TEST_F(ShadowTest, BothTechniquesSumToTheIntegral) {
    const dvec3 wo = glm::normalize(dvec3(-1, 0.9, 0.2));
    for (const Case& c : materials()) {
        for (const RectangleLight& light : kLights) {
            SCOPED_TRACE(c.name);
            Scene scene = floor_scene(c.material, 2);
            add_light(scene, light);
            const RenderResult r =
                render(context, scene, small_settings(spot_camera(dvec3(0), wo, 1e-3), 64, 64, 32, 1));
            const Components expected = quadrature(light, oracle_bsdf(c.material, wo), false);
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

TEST_F(ShadowTest, FormFactorsOfParallelAndPerpendicularSquares) {
    const Material material = diffuse_material({0.2f, 0.5f, 0.8f});
    const struct {
        const char* name;
        RectangleLight light;
        double factor;
    } cases[] = {
        {"parallel", {{0, 1, 0}, {1, 0, 0}, {0, 0, 1}}, factor_of_parallel(1, 1, 1)},
        {"parallel, near", {{0, 0.2f, 0}, {1, 0, 0}, {0, 0, 1}}, factor_of_parallel(1, 1, 0.2)},
        {"perpendicular", {{0.5f, 0, 0}, {0, 1, 0}, {0, 0, 1}}, factor_of_perpendicular(1, 1, 0.5)},
        {"perpendicular, far", {{3, 0, 0}, {0, 1, 0}, {0, 0, 1}}, factor_of_perpendicular(1, 1, 3)},
    };
    for (const auto& c : cases) {
        SCOPED_TRACE(c.name);
        // The integral validates the published closed forms.
        const Components integral = quadrature(c.light, oracle_bsdf(material, kUp), false);
        EXPECT_NEAR(integral.diffuse.x, 0.2 * c.factor * c.light.radiance.x, 1e-4 * c.factor);
        for (const bool half_hidden : {false, true}) {
            Scene scene = floor_scene(material);
            add_light(scene, c.light);
            double factor = c.factor;
            if (half_hidden) {
                // A card halfway to the light hides the light's part with z > 1/2. The card is large beyond z = 1/4.
                const vec3 shrunk = 0.5f * c.light.corner + vec3(0, 0, 0.25f);
                const vec3 step = c.light.u.x > 0 ? vec3(2, 0, 0) : vec3(0, 2, 0);
                add_quad(scene, add_material(scene, diffuse_material(vec3(0))), shrunk - 0.5f * step, step, {0, 0, 2});
                factor = c.light.u.x > 0 ? factor_of_parallel(1, 0.5, c.light.corner.y)
                                         : factor_of_perpendicular(1, 0.5, c.light.corner.x);
            }
            RenderSettings settings = small_settings(spot_camera(dvec3(0), {-0.4, 0.1, -0.5}, 1e-3), 64, 64, 32, 1);
            settings.camera.camera_to_world[3] = dvec4(0.05 * dvec3(settings.camera.camera_to_world[2]), 1);
            const RenderResult r = render(context, scene, settings);
            for (int i = 0; i < 3; ++i) {
                const double expected = material.base_color[i] * factor * c.light.radiance[i];
                const MeanValue m = mean_of_pixels(r.beauty, i);
                EXPECT_NEAR(m.value, expected, 4 * m.error + 2e-4 * expected) << half_hidden;
                EXPECT_LE(m.error, 0.01 * expected);
            }
        }
    }
}

TEST_F(ShadowTest, ConstantEnvironment) {
    Scene scene = floor_scene(diffuse_material({0.2f, 0.5f, 0.8f}));
    scene.environment.color = {1, 2, 3};
    Stage stage(programs, scene, spot_camera(dvec3(0), kUp, 1e-3), {128, 128});
    const Found found = mean_over(stage, 4);
    const RenderResult whole = render(context, scene, small_settings(spot_camera(dvec3(0), kUp, 1e-3), 64, 64, 16, 1));
    for (int i = 0; i < 3; ++i) {
        const double reflected = scene.materials[0].base_color[i] * scene.environment.color[i];
        // The light's density is 1 / 4 pi, the surface's mu / pi. The expected value is the integral of 2 mu / (1 + 16
        // mu^2) over mu in [0, 1].
        expect_mean(found.diffuse[i], reflected * std::log(17.0) / 16, 0.01, "light sampling alone");
        const MeanValue m = mean_of_pixels(whole.beauty, i);
        EXPECT_NEAR(m.value, reflected, 4 * m.error + 1e-5);
        EXPECT_LE(m.error, 0.01 * reflected);
    }
}

// --- Lights without extent: one sample is exact -----------------------------------------------------------------

PunctualLight point_light() {
    PunctualLight l;
    l.intensity = {3, 5, 7};
    l.position = {0.4, 1.5, -0.3};
    return l;
}
PunctualLight spot_light() {
    PunctualLight l = point_light();
    l.type = LightType::spot;
    l.direction = glm::normalize(vec3(-0.2f, -1, 0.1f));
    l.inner_cone = 0.3f;
    l.outer_cone = 0.6f;
    return l;
}
PunctualLight sun() {
    PunctualLight l = point_light();
    l.type = LightType::directional;
    l.direction = glm::normalize(vec3(-0.2f, -1, 0.7f));
    return l;
}

/// Returns the irradiance at a point of a floor (SHADING.md, "Lights").
dvec3 irradiance(const PunctualLight& l, const dvec3& p) {
    if (l.type == LightType::directional) return dvec3(l.intensity) * std::max(-double(l.direction.y), 0.0);
    const dvec3 d = l.position - p;
    double e = std::max(d.y, 0.0) / std::pow(glm::dot(d, d), 1.5);
    if (l.type == LightType::spot) {
        const double cosine = -glm::dot(glm::normalize(d), dvec3(l.direction)), outer = std::cos(double(l.outer_cone));
        const double cone =
            std::clamp((cosine - outer) / std::max(std::cos(double(l.inner_cone)) - outer, 1e-3), 0.0, 1.0);
        e *= cone * cone;
    }
    return dvec3(l.intensity) * e;
}

TEST_F(ShadowTest, PunctualLightsAreExactAtEveryPixel) {
    for (const PunctualLight& light : {point_light(), spot_light(), sun()}) {
        Scene scene = floor_scene(diffuse_material({0.2f, 0.5f, 0.8f}));
        scene.lights = {light};
        Stage stage(programs, scene, look_at_camera({0, 3, 2}, {0, 0, 0}, kUp, 1.1), {48, 32});
        const Sample s = shadow(stage);
        int lit = 0;
        for (int y = 0; y < 32; ++y) {
            for (int x = 0; x < 48; ++x) {
                const std::size_t path = stage.path(x, y);
                const dvec3 position = dvec3(s.surfaces[path].position) + stage.trace_tables().origin;
                const dvec3 expected = dvec3(scene.materials[0].base_color) / kPi * irradiance(light, position);
                // At the cone's edge, cosines have errors of 2^-22. They are scaled by 1 / 0.13 and by a value of up to
                // 4.
                for (int i = 0; i < 3; ++i)
                    EXPECT_NEAR(s.light[path].diffuse[i], expected[i], 2e-5 * expected[i] + 1e-5) << x << ", " << y;
                if (expected.x > 0) {
                    EXPECT_EQ(s.occluded[path], 0u);
                    ++lit;
                }
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
    scene.lights = {point_light()};
    scene.lights[0].position.y = -1e-3;
    Stage stage(programs, scene, look_at_camera({0, 3, 2}, {0, 0, 0}, kUp, 1.1), {48, 32});
    for (const shared::DirectLight& l : shadow(stage).light) EXPECT_EQ(l.diffuse + l.glossy, vec3(0));
}

TEST_F(ShadowTest, ManyLightsAreSummedBySelectingOne) {
    Scene scene;  // small, because the sun's power is that on the whole scene, and selection is by power
    add_quad(scene, add_material(scene, diffuse_material(vec3(0.5f))), {-2, 0, -2}, {0, 0, 4}, {4, 0, 0});
    scene.lights = {point_light(), spot_light(), sun()};
    scene.lights[1].position = {0, 1, 0};
    scene.lights[2].intensity = {0.1f, 1, 0.5f};
    Stage stage(programs, scene, spot_camera(dvec3(0), kUp, 1e-3), {64, 64});
    const Found found = mean_over(stage, 32);
    for (int i = 0; i < 3; ++i) {
        double expected = 0;
        for (const PunctualLight& l : scene.lights) expected += 0.5 / kPi * irradiance(l, dvec3(0))[i];
        expect_mean(found.diffuse[i], expected, 0.01, "diffuse");
    }
}

TEST_F(ShadowTest, PointLightsCastSharpShadows) {
    Scene scene = floor_scene(diffuse_material(vec3(0.5f)));
    scene.lights = {point_light()};
    scene.lights[0].position = {0, 2, 0};
    // The occluder is halfway up and covers x > 1/2 of the floor; its far edge is outside the view.
    add_quad(scene, add_material(scene, diffuse_material(vec3(0))), {0.25f, 1, -5}, {0, 0, 10}, {5, 0, 0});
    Camera camera = look_at_camera({0, 0.9, 0}, {0, 0, 0}, {0, 0, -1}, 1);
    camera.orthographic = true;
    camera.ortho_height = 2;
    Stage stage(programs, scene, camera, {64, 64});
    const Sample s = shadow(stage);
    for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 64; ++x) {
            const double at = (x + 0.5) / 32 - 1;
            EXPECT_EQ(s.occluded[stage.path(x, y)], at > 0.5 ? 1u : 0u) << x << ", " << y;
        }
    }
}

}  // namespace
}  // namespace halflight::test
