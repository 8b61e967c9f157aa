// Tests paths: scattering at the first surface against the oracle's BSDF, and many bounces with a known course between
// two mirrors.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/core/statistics.h"
#include "passes/light/first_scatter.h"
#include "passes/surface/gbuffer.h"
#include "shaders/shared/path_state.h"
#include "tests/pass/light/closed_forms.h"
#include "tests/pass/light/density_check.h"
#include "tests/pass/picture/pixels.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/pass/stage.h"

namespace halflight::test {
namespace {

const dvec3 kUp(0, 1, 0);

class ScatterTest : public PassTest {
  protected:
    struct Batch {
        shared::ListHeader header;
        std::vector<shared::uint> paths;  // the used part of the list
    };
    struct Scattered {
        std::vector<SurfaceRecord> surfaces;
        std::vector<shared::Ray> rays;
        std::vector<shared::PathState> states;
        Batch diffuse, glossy;
    };
    Scattered scatter(Stage& stage) {
        const SceneNeeds& needs = stage.buffers().needs();
        graph::Graph graph;
        const SceneView view = stage.view(graph);
        const GBuffer g = add_gbuffer(graph, view);
        PathBuffers paths = create_path_buffers(graph, view);
        PathList diffuse, glossy;
        if (needs.diffuse) diffuse = add_diffuse(graph, view, g, paths);
        if (needs.glossy) glossy = add_glossy(graph, view, g, paths);
        for (const graph::BufferHandle h :
             {g.surfaces, paths.rays, paths.states, diffuse.list, diffuse.header, glossy.list, glossy.header})
            if (h) graph.output(h);
        run(graph);
        Scattered s;
        s.surfaces = unpack_surfaces(executor.read<vec4>(g.surfaces), needs);
        s.rays = executor.read<shared::Ray>(paths.rays);
        s.states = executor.read<shared::PathState>(paths.states);
        const auto read = [&](const PathList& list) {
            if (!list.list) return Batch{{0, 1, 1, 0}, {}};
            Batch b{executor.read<shared::ListHeader>(list.header)[0], executor.read<shared::uint>(list.list)};
            b.paths.resize(b.header.count);
            return b;
        };
        s.diffuse = read(diffuse);
        s.glossy = read(glossy);
        return s;
    }

    /// Checks that lists and states agree.
    static void expect_consistent(const Scattered& s) {
        std::vector<shared::uint> lobe(s.states.size(), shared::kLobeNone);
        for (const bool is_diffuse : {true, false}) {
            const Batch& b = is_diffuse ? s.diffuse : s.glossy;
            EXPECT_EQ(b.header.groups_x, (b.header.count + 63) / 64);
            EXPECT_EQ(b.header.groups_y, 1u);
            EXPECT_EQ(b.header.groups_z, 1u);
            for (const shared::uint path : b.paths) {
                ASSERT_LT(path, lobe.size());
                ASSERT_EQ(lobe[path], shared::kLobeNone) << "path " << path << " is in two places";
                lobe[path] = is_diffuse ? shared::kLobeDiffuse : shared::kLobeGlossy;
            }
        }
        for (std::size_t path = 0; path < lobe.size(); ++path) {
            const shared::PathState& state = s.states[path];
            ASSERT_EQ(state.lobe, lobe[path]) << path;
            if (lobe[path] == shared::kLobeNone) continue;
            ASSERT_TRUE(s.surfaces[path].is_surface);
            EXPECT_EQ(state.direct, vec3(0));
            EXPECT_EQ(state.indirect, vec3(0));
            EXPECT_EQ(state.pending_light, 0u);
            EXPECT_TRUE(all_finite(state.throughput));
            const shared::Ray& ray = s.rays[path];
            EXPECT_NEAR(glm::length(ray.direction), 1, 1e-6);
            EXPECT_EQ(ray.t_min, 0);
            EXPECT_EQ(ray.t_max, kInfinity);
        }
    }
};

/// One BSDF and one direction: a floor seen by an orthographic camera.
struct Case {
    const char* name;
    Material material;
};

Material dielectric(const vec3& color, float roughness) {
    Material m = metal_material(color, roughness);
    m.metallic = 0;
    return m;
}

std::vector<Case> rough_cases() {
    std::vector<Case> cases{{"diffuse", diffuse_material({0.2f, 0.5f, 0.8f})},
                            {"metal", metal_material({0.9f, 0.6f, 0.3f}, 0.6f)},
                            {"smooth metal", metal_material({0.9f, 0.6f, 0.3f}, 0.3f)},
                            {"dielectric", dielectric({0.2f, 0.5f, 0.8f}, 0.5f)}};
    Material m = dielectric({0.7f, 0.8f, 0.3f}, 0.7f);
    m.transmission = 0.6f;
    cases.push_back({"transmission", m});
    m.clearcoat = 0.8f;
    m.clearcoat_roughness = 0.4f;
    cases.push_back({"transmission under a coat", m});
    m = dielectric({0.7f, 0.8f, 0.3f}, 0.9f);
    m.metallic = 0.5f;
    m.specular = 0.6f;
    m.specular_color = {1, 0.5f, 0.2f};
    m.ior = 1.8f;
    cases.push_back({"half metal", m});
    return cases;
}

/// Returns the p-value of directions against a density per solid angle. `total` is the number of samples drawn,
/// including those without a direction, which form a bin of their own.
template <class Density>
double direction_p_value(const std::vector<dvec3>& directions, double total, Density&& density) {
    DirectionBins bins;
    for (int i = 0; i < DirectionBins::kGrid; ++i) bins.expect(i, density(DirectionBins::grid_direction(i)), total);
    for (const dvec3& d : directions) bins.count(d);
    bins.expected.push_back(total - bins.expected_directions());
    bins.found.push_back(total - bins.directions);
    return chi_square(bins.found, bins.expected, 8).p_value();
}

/// The paths suffice to show a density that is 10 % off over half of a lobe: chi-square grows by about 160, five
/// standard deviations.
TEST_F(ScatterTest, DirectionsFollowTheBsdfAndWeightsTheirDensity) {
    for (const Case& c : rough_cases()) {
        for (const double elevation : {0.15, 1.2}) {
            SCOPED_TRACE(std::string(c.name) + ", elevation " + std::to_string(elevation));
            const dvec3 wo = glm::normalize(dvec3(std::cos(elevation), std::sin(elevation), 0.4 * std::cos(elevation)));
            Stage stage(programs, floor_scene(c.material), spot_camera(dvec3(0), wo, 0.01), {128, 128});
            stage.select_sample(5, 11);
            const Scattered s = scatter(stage);
            expect_consistent(s);
            const reference::Bsdf bsdf = oracle_bsdf(c.material, wo);
            for (const bool is_diffuse : {true, false}) {
                const Batch& batch = is_diffuse ? s.diffuse : s.glossy;
                std::vector<dvec3> directions;
                double worst_pdf = 0, worst_weight = 0;
                for (const shared::uint path : batch.paths) {
                    const shared::Ray& ray = s.rays[path];
                    directions.emplace_back(ray.direction);
                    const reference::Bsdf::Value v = bsdf.evaluate(glm::normalize(directions.back()));
                    const double pdf = is_diffuse ? v.pdf_diffuse : v.pdf_glossy;
                    const dvec3 weight = (is_diffuse ? v.diffuse : v.glossy) / pdf;
                    worst_pdf = std::max(worst_pdf, std::abs(s.states[path].pdf / pdf - 1));
                    for (int i = 0; i < 3; ++i)
                        worst_weight = std::max(worst_weight, std::abs(s.states[path].throughput[i] / weight[i] - 1));
                    // The ray starts on the side of the floor into which it goes.
                    EXPECT_GT(ray.origin.y * ray.direction.y, 0);
                    EXPECT_LT(std::abs(ray.origin.y), 1e-3);
                }
                // Interpolation of the albedo table changes the probabilities of the lobes, and thereby density and
                // weight. At the horizon the cosine is known only to 2^-24 of the coordinates.
                EXPECT_LT(worst_pdf, 0.01);
                EXPECT_LT(worst_weight, 0.01);
                const double p = direction_p_value(directions, 128 * 128, [&](const dvec3& wi) {
                    const reference::Bsdf::Value v = bsdf.evaluate(wi);
                    return is_diffuse ? v.pdf_diffuse : v.pdf_glossy;
                });
                EXPECT_GT(p, 1e-4) << (is_diffuse ? "diffuse" : "glossy") << ", " << directions.size() << " samples";
            }
        }
    }
}

TEST_F(ScatterTest, BlackSurfacesEndPaths) {
    Scene scene = floor_scene(diffuse_material(vec3(0)));
    add_quad(scene, add_material(scene, diffuse_material(vec3(1))), {0, -1, 0}, {1, 0, 0}, {0, 0, 1});
    Stage stage(programs, scene, spot_camera({0, 0, 0}, kUp, 1), {16, 16});
    const Scattered s = scatter(stage);
    expect_consistent(s);
    EXPECT_TRUE(s.diffuse.paths.empty());
}

constexpr float kWall = 4;       // height of the mirrors
constexpr double kSlope = 0.35;  // rise of a ray per unit of horizontal distance
constexpr int kWidth = 24, kHeight = 96;

/// Mirrors at z = -1 and z = 1 that end at y = kWall, under a sky. The camera is between the mirrors and looks up at
/// the first one. The number of reflections before a ray reaches the sky differs by pixel row.
class CorridorTest : public GpuTest {
  protected:
    CorridorTest() {
        scene.environment.color = {1, 2, 4};
        const int mirror = add_material(scene, metal_material(color, 0));
        add_quad(scene, mirror, {-50, -9, -1}, {100, 0, 0}, {0, 9 + kWall, 0});
        add_quad(scene, mirror, {-50, -9, 1}, {100, 0, 0}, {0, 9 + kWall, 0});
        camera = look_at_camera({0, 2, 0}, {0, 2 + kSlope, -1}, {0, 1, 0}, 1);
        camera.orthographic = true;
        camera.ortho_height = 4.5;
    }

    /// Returns the number of reflections of the ray through a row's point, or -1 if the ray passes too close to an end
    /// of a mirror.
    int reflections(double row) const {
        const double slant = std::sqrt(1 + kSlope * kSlope);
        // The camera's plane is tilted, so a pixel's ray starts as far behind the centre in z as above it in y.
        const double up = (1 - 2 * row / kHeight) * camera.ortho_height / 2;
        double y = 2 + up / slant, z = up * kSlope / slant;
        y += kSlope * (z + 1);
        int count = 0;
        while (y < kWall) {
            if (kWall - y < 1e-3) return -1;
            y += 2 * kSlope;
            ++count;
        }
        return y - kWall < 1e-3 && count == 0 ? -1 : count;
    }
    dvec3 reflectance() const {
        const double cosine = 1 / std::sqrt(1 + kSlope * kSlope);
        return dvec3(color) + (1.0 - dvec3(color)) * std::pow(1 - cosine, 5);
    }

    const vec3 color{0.9f, 0.7f, 0.5f};
    Scene scene;
    Camera camera;
};

TEST_F(CorridorTest, EveryPathHasTheProductOfItsReflectances) {
    for (const int bounces : {0, 1, 2, 3}) {  // Russian roulette starts only at the third vertex after the first
        RenderSettings settings = small_settings(camera, kWidth, kHeight, 1, bounces);
        const RenderResult r = render(context, scene, settings);
        // The sample's position in its pixel is unknown here. Rows that may see the end of a mirror are skipped.
        int seen[5] = {0, 0, 0, 0, 0};
        for (int y = 0; y < kHeight; ++y) {
            const int n = reflections(y + 0.5);
            if (n < 0 || reflections(y) != n || reflections(y + 1) != n) continue;
            ++seen[std::min(n, 4)];
            const dvec3 sky(scene.environment.color);
            const dvec3 expected = n > bounces ? dvec3(0) : sky * glm::pow(reflectance(), dvec3(n));
            const std::string own = n == 0 ? "emission" : n == 1 ? "direct_glossy" : "indirect_glossy";
            for (const char* component :
                 {"emission", "direct_glossy", "indirect_glossy", "direct_diffuse", "indirect_diffuse"}) {
                const Image& image = layer(r, std::string(component) + ".R");
                for (int i = 0; i < 3 * kWidth; ++i) {
                    const double value = component == own ? expected[i % 3] : 0;
                    ASSERT_NEAR(image.at(0, y)[i], value, 1e-5 * value)
                        << component << ", bounces " << bounces << ", reflections " << n << ", row " << y;
                }
            }
        }
        for (const int rows : seen) EXPECT_GT(rows, 3);
    }
}

TEST_F(CorridorTest, RouletteKeepsTheMean) {
    // The count is no power of two. If all strata of the roulette were filled, pixels would hardly differ.
    const RenderSettings settings = small_settings(camera, kWidth, kHeight, 61, 12);
    const RenderResult r = render(context, scene, settings);
    int deep = 0;
    for (int y = 0; y < kHeight; ++y) {
        const int n = reflections(y + 0.5);
        if (n < 0 || reflections(y) != n || reflections(y + 1) != n) continue;
        const dvec3 expected = dvec3(scene.environment.color) * glm::pow(reflectance(), dvec3(n));
        deep += n >= 4;
        for (int c = 0; c < 3; ++c) {
            RunningMoments row;
            for (int x = 0; x < kWidth; ++x) row.add(r.beauty.at(x, y)[c]);
            EXPECT_NEAR(row.mean(), expected[c], 4.5 * row.standard_error() + 1e-5 * expected[c]) << n << ", row " << y;
            EXPECT_LT(row.standard_error(), 0.05 * expected[c]) << n << ", row " << y;
        }
    }
    EXPECT_GT(deep, 10);
}

TEST_F(CorridorTest, TwelveBouncesAreTwelve) {
    // The mirrors are practically endless, so no light arrives.
    scene.meshes[0].positions[2].y = scene.meshes[0].positions[3].y = 1e3f;
    scene.meshes[1].positions[2].y = scene.meshes[1].positions[3].y = 1e3f;
    const RenderResult r = render(context, scene, small_settings(camera, kWidth, kHeight, 2, 12));
    for (const auto& [x, y] : pixels_of({kWidth, kHeight})) EXPECT_EQ(r.beauty.at(x, y)[0], 0);
    for (const BadValues& n : r.stats.bad_values) EXPECT_EQ(n.total(), 0u);
}

}  // namespace
}  // namespace halflight::test
