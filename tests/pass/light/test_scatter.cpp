// Tests diffuse and glossy scattering at the first surface: probabilities, directions and weights against the oracle's
// BSDF.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/reference/bsdf.h"
#include "passes/light/diffuse.h"
#include "passes/light/glossy.h"
#include "shaders/shared/path.h"
#include "tests/pass/scenes.h"
#include "tests/pass/stage.h"
#include "tests/support/image_tests.h"

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
        std::vector<shared::Ray> primary;
        std::vector<SurfaceRecord> surfaces;
        std::vector<shared::Ray> rays;
        std::vector<shared::Hit> hits;
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
        for (const graph::BufferHandle h : {g.rays, g.surfaces, paths.rays, paths.hits, paths.states, diffuse.list,
                                            diffuse.header, glossy.list, glossy.header})
            if (h) graph.output(h);
        run(graph);
        Scattered s;
        s.primary = executor.read<shared::Ray>(g.rays);
        s.surfaces = unpack_surfaces(executor.read<vec4>(g.surfaces), needs);
        s.rays = executor.read<shared::Ray>(paths.rays);
        s.hits = executor.read<shared::Hit>(paths.hits);
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

    /// Checks that lists and states agree; returns the number of paths that scatter into each component.
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

reference::Bsdf oracle_bsdf(const Material& m, const dvec3& wo) {
    reference::BsdfParameters p;
    p.base_color = dvec3(m.base_color);
    p.metallic = m.metallic, p.roughness = m.roughness;
    p.specular = m.specular, p.specular_color = m.specular_color, p.ior = m.ior;
    p.clearcoat = m.clearcoat, p.clearcoat_roughness = m.clearcoat_roughness, p.transmission = m.transmission;
    return {p, wo, kUp, kUp, kUp};
}

/// Returns chi-square of directions against a density per solid angle, over kRows x kColumns cells of equal solid
/// angle. `total` is the number of samples drawn, including those without a direction.
template <class Density>
double direction_p_value(const std::vector<dvec3>& directions, double total, Density&& density) {
    constexpr int kRows = 24, kColumns = 24, kFine = 24;
    std::vector<double> expected(kRows * kColumns), found(kRows * kColumns);
    for (int r = 0; r < kRows * kFine; ++r) {
        const double y = 1 - 2 * (r + 0.5) / (kRows * kFine), around = std::sqrt(1 - y * y);
        for (int c = 0; c < kColumns * kFine; ++c) {
            const double phi = 2 * kPi * (c + 0.5) / (kColumns * kFine);
            expected[static_cast<std::size_t>(r / kFine * kColumns + c / kFine)] +=
                total * density(dvec3(around * std::cos(phi), y, around * std::sin(phi))) * 4 * kPi /
                (kRows * kColumns * kFine * kFine);
        }
    }
    for (const dvec3& d : directions) {
        double phi = std::atan2(d.z, d.x);
        phi += phi < 0 ? 2 * kPi : 0;
        const int r = std::clamp(static_cast<int>((1 - d.y) / 2 * kRows), 0, kRows - 1);
        const int c = std::clamp(static_cast<int>(phi / (2 * kPi) * kColumns), 0, kColumns - 1);
        ++found[static_cast<std::size_t>(r * kColumns + c)];
    }
    // Samples without a direction form a cell of their own. Cells with few samples are merged.
    expected.push_back(total), found.push_back(total - static_cast<double>(directions.size()));
    for (std::size_t i = 0; i + 1 < expected.size(); ++i) expected.back() -= expected[i];
    double square = 0, rare_expected = 0, rare_found = 0;
    int cells = -1;
    for (std::size_t i = 0; i < expected.size(); ++i) {
        if (expected[i] < 8) {
            rare_expected += expected[i], rare_found += found[i];
        } else {
            square += (found[i] - expected[i]) * (found[i] - expected[i]) / expected[i];
            ++cells;
        }
    }
    if (rare_expected > 8) {
        square += (rare_found - rare_expected) * (rare_found - rare_expected) / rare_expected;
        ++cells;
    } else if (rare_found > rare_expected + 10 * std::sqrt(rare_expected + 1)) {
        return 0;
    }
    return cells > 0 ? chi_square_tail(square, cells) : 1;
}

TEST_F(ScatterTest, DirectionsFollowTheBsdfAndWeightsTheirDensity) {
    for (const Case& c : rough_cases()) {
        for (const double elevation : {0.15, 1.2}) {
            SCOPED_TRACE(std::string(c.name) + ", elevation " + std::to_string(elevation));
            const dvec3 wo = glm::normalize(dvec3(std::cos(elevation), std::sin(elevation), 0.4 * std::cos(elevation)));
            Stage stage(programs, floor_scene(c.material), spot_camera(dvec3(0), wo, 0.01), {256, 256});
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
                const double p = direction_p_value(directions, 65536, [&](const dvec3& wi) {
                    const reference::Bsdf::Value v = bsdf.evaluate(wi);
                    return is_diffuse ? v.pdf_diffuse : v.pdf_glossy;
                });
                EXPECT_GT(p, 1e-4) << (is_diffuse ? "diffuse" : "glossy") << ", " << directions.size() << " samples";
            }
        }
    }
}

TEST_F(ScatterTest, MirrorsHaveOneDirection) {
    const dvec3 wo = glm::normalize(dvec3(1, 0.7, -0.4));
    const double cosine = wo.y, schlick = std::pow(1 - cosine, 5);
    Material glass = dielectric(vec3(1), 0);
    glass.transmission = 1;
    for (const bool transmits : {false, true}) {
        const Material m = transmits ? glass : metal_material({0.9f, 0.6f, 0.3f}, 0);
        Stage stage(programs, floor_scene(m), spot_camera(dvec3(0), wo, 0.01), {32, 32});
        const Scattered s = scatter(stage);
        expect_consistent(s);
        EXPECT_EQ(s.glossy.paths.size(), 1024u);
        int through = 0;
        for (const shared::uint path : s.glossy.paths) {
            const dvec3 direction(s.rays[path].direction);
            EXPECT_EQ(s.states[path].pdf, 0) << "a delta";
            const bool reflected = direction.y > 0;
            const dvec3 expected = reflected ? dvec3(-wo.x, wo.y, -wo.z) : -wo;
            EXPECT_LT(glm::length(direction - expected), 2e-6);
            through += !reflected;
            for (int i = 0; i < 3; ++i) {
                // Glass selects each side in proportion to its albedo, so both sides have weight 1.
                const double c = m.base_color[i], weight = transmits ? 1 : c + (1 - c) * schlick;
                EXPECT_NEAR(s.states[path].throughput[i], weight, 1e-5);
            }
        }
        const double share = transmits ? 1 - (0.04 + 0.96 * schlick) : 0;
        EXPECT_NEAR(through / 1024.0, share, 4 * std::sqrt(share * (1 - share) / 1024) + 1e-9);
    }
}

TEST_F(ScatterTest, RaysAreTracedAndOtherPathsAreUnchanged) {
    // The left half is a floor under a ceiling; the right half is empty.
    Scene scene;
    const int grey = add_material(scene, diffuse_material(vec3(0.5f)));
    add_quad(scene, grey, {-50, 0, -50}, {0, 0, 100}, {50, 0, 0});
    add_quad(scene, grey, {-100, 3, -100}, {0, 0, 200}, {200, 0, 0});
    Stage stage(programs, scene, spot_camera(dvec3(0), kUp, 1), {40, 40});
    const Scattered s = scatter(stage);
    expect_consistent(s);
    EXPECT_EQ(s.diffuse.paths.size(), 800u);
    for (const shared::uint path : s.diffuse.paths) {
        const shared::Ray& ray = s.rays[path];
        const shared::Hit& hit = s.hits[path];
        if (ray.direction.y < 0.05f) continue;  // the ray passes beside the ceiling
        ASSERT_NE(hit.triangle, shared::kMiss);
        EXPECT_EQ(source_of(stage.trace_tables(), hit.instance, hit.triangle).instance, 1u);
        const double t = (3 - (double(ray.origin.y) + stage.trace_tables().origin.y)) / ray.direction.y;
        EXPECT_NEAR(hit.t / t, 1, 1e-4);
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

}  // namespace
}  // namespace halflight::test
