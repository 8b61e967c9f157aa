// Tests the traversal of the light tree on the GPU: the frequency of selections equals the probability given by the
// descent and by the trail.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

#include "engine/tables/light_tree.h"
#include "shaders/shared/light.h"
#include "shaders/shared/word.h"
#include "tests/pass/light/closed_forms.h"
#include "tests/pass/light/density_check.h"
#include "tests/pass/light/shading_kernel.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

/// Returns squares, point lights and spot lights of all kinds in a box of side 2, and a sun.
Scene many_lights(int squares, int bulbs, int spots) {
    std::mt19937 random(21);
    const auto in = [&](double low, double high) { return low + (high - low) * random() * 0x1p-32; };
    const auto direction = [&] {
        const double y = in(-1, 1), turn = in(0, 2 * kPi), r = std::sqrt(1 - y * y);
        return dvec3(r * std::cos(turn), y, r * std::sin(turn));
    };
    const auto place = [&] { return dvec3(in(-1, 1), in(-1, 1), in(-1, 1)); };
    Scene scene = triangle_scene({});
    Mesh mesh;
    for (int i = 0; i < squares; ++i) {
        const dvec3 at = place(), u = in(0.01, 0.1) * direction(),
                    v = in(0.01, 0.1) * glm::normalize(glm::cross(u, direction()));
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        for (const dvec3& p : {at, at + u, at + u + v, at + v}) mesh.positions.emplace_back(p);
        mesh.triangles.insert(mesh.triangles.end(), {{first, first + 1, first + 2}, {first, first + 2, first + 3}});
        const auto material = static_cast<std::uint32_t>(scene.materials.size());
        mesh.triangle_material.insert(mesh.triangle_material.end(), 2, material);
        scene.materials.emplace_back().emission = vec3(static_cast<float>(std::exp(in(0, 6))));
    }
    if (squares > 0) {
        mesh.normals.assign(mesh.positions.size(), vec3(0, 0, 1));
        Instance instance;
        instance.mesh = static_cast<int>(scene.meshes.size());
        scene.meshes.push_back(mesh);
        scene.instances.push_back(instance);
    }
    for (int i = 0; i < bulbs + spots; ++i) {
        PunctualLight& light = scene.lights.emplace_back();
        light.type = i < bulbs ? LightType::point : LightType::spot;
        light.position = place();
        light.direction = vec3(direction());
        light.intensity = vec3(static_cast<float>(std::exp(in(-2, 3))));
        light.inner_cone = static_cast<float>(in(0, 0.5));
        light.outer_cone = light.inner_cone + static_cast<float>(in(0.01, 0.6));
    }
    PunctualLight& sun = scene.lights.emplace_back();
    sun.type = LightType::directional;
    sun.intensity = vec3(0.1f);
    return scene;
}

/// Returns receivers among the lights, and receivers outside that face the lights.
std::vector<vec4> receivers(int count) {
    std::mt19937 random(22);
    std::vector<vec4> rows;  // rows of position and normal
    for (int i = 0; i < count; ++i) {
        const double reach = i % 2 == 0 ? 0.5 : 4;
        const auto one = [&] { return 2 * (random() * 0x1p-32) - 1; };
        const double x = one(), y = one(), z = one();
        const dvec3 position = reach * dvec3(x, y, z);
        const double u = one(), v = one(), w = one();
        const dvec3 normal = glm::normalize(dvec3(u, v, w) - (reach > 1 ? position : dvec3(0)));
        rows.emplace_back(vec3(position), 0);
        rows.emplace_back(vec3(normal), 0);
    }
    return rows;
}

const char* const kLibrary = R"(
#include "shaders/lib/lights.glsl"
Receiver receiver_number(uint i) { return receiver_at(inputs[2u * i].xyz, inputs[2u * i + 1u].xyz); }
)";

class LightWays : public GpuTest {
  protected:
    static constexpr std::uint32_t kReceivers = 6;

    /// Returns the probability of each light in the tree for each receiver, by the light's trail.
    static std::vector<std::vector<float>> by_trail(const ShadingScene& shading, const std::vector<vec4>& at,
                                                    std::uint32_t lights) {
        const auto found = shading.run(kLibrary, "const uint kLights = " + std::to_string(lights) + R"(u;
            uint head = word_of_float(texelFetch(scene_lights, int(i % kLights) * kLightStride).w);
            LightWay way = light_way(receiver_number(i / kLights), true, light_trail(head), 0u);
            result[0] = vec4(way.probability, float(way.light), 0.0, 0.0);
        )",
                                       kReceivers * lights, 1, at);
        std::vector<std::vector<float>> all(kReceivers);
        for (std::uint32_t i = 0; i < found.size(); ++i) {
            all[i / lights].push_back(found[i].x);
            EXPECT_TRUE(found[i].x == 0 || found[i].y == static_cast<float>(i % lights)) << "light " << i % lights;
        }
        return all;
    }
};

/// The descents show a probability that is 5 % off for half of the lights of a receiver: chi-square grows by about 80,
/// six standard deviations of that of 80 lights.
TEST_F(LightWays, FollowTheirProbabilities) {
    constexpr std::uint32_t kWays = 1u << 15;
    for (const auto& [squares, bulbs, spots] : {std::array{20, 20, 20}, std::array{64, 0, 0}, std::array{0, 24, 24}}) {
        const ShadingScene shading(many_lights(squares, bulbs, spots));
        ASSERT_TRUE(shading.tables.needs.light_tree);
        const auto in_tree = static_cast<std::uint32_t>(2 * squares + bulbs + spots);
        const std::vector<vec4> at = receivers(kReceivers);
        const auto tabulated = by_trail(shading, at, in_tree);
        const auto ways = shading.run(kLibrary, R"(
            // The chi-square test needs independent numbers.
            LightWay way = light_way(receiver_number(i >> 15), false, 0u, hash_combine(hash_u32(i), 91u));
            result[0] = vec4(float(way.light), way.probability, 0.0, 0.0);
        )",
                                      kReceivers * kWays, 1, at);
        for (std::uint32_t r = 0; r < kReceivers; ++r) {
            SCOPED_TRACE(std::to_string(squares) + " squares, receiver " + std::to_string(r));
            std::vector<double> found(in_tree), expected(in_tree);
            double sum = 0, dark = 0;
            for (std::size_t i = r * kWays; i < (r + 1) * kWays; ++i) {
                if (ways[i].y == 0) {
                    ++dark;
                    continue;
                }
                const auto light = static_cast<std::size_t>(ways[i].x);
                ASSERT_LT(light, in_tree);
                ASSERT_EQ(ways[i].y, tabulated[r][light]) << "descent and trail give equal bits";
                ++found[light];
            }
            for (std::uint32_t k = 0; k < in_tree; ++k) {
                expected[k] = double(tabulated[r][k]) * kWays;
                sum += tabulated[r][k];
            }
            EXPECT_LE(sum, 1 + 1e-5);
            // Descents that end without a light account for the rest to 1. A share of p has a standard error of sqrt(p
            // / kWays).
            EXPECT_NEAR(dark / kWays, 1 - sum, 6 * std::sqrt(std::max(1 - sum, 1e-4) / kWays));
            const test::ChiSquare test = test::chi_square(found, expected, 5);
            EXPECT_GE(test.degrees, 3);
            EXPECT_GT(test.p_value(), 1e-7);
        }
    }
}

/// CPU and GPU compile the same importance functions from one source.
TEST_F(LightWays, EqualTheCpus) {
    const ShadingScene shading(many_lights(20, 20, 20));
    constexpr std::uint32_t kLights = 80;
    const std::vector<vec4> at = receivers(kReceivers);
    const auto tabulated = by_trail(shading, at, kLights);
    const std::vector<uvec4>& rows = shading.tables.light_tree;
    int pairs = 0;
    for (std::uint32_t r = 0; r < kReceivers; ++r) {
        const vec3 position(at[2 * r]), normal(at[2 * r + 1]);
        for (std::uint32_t k = 0; k < kLights; ++k) {
            const float head = shading.tables.lights[std::size_t{k} * shared::kLightStride].w;
            std::uint32_t trail = shared::light_trail(shared::word_of_float(head));
            LightTreeChild way{.bounds = {}, .leaf = false, .index = 0, .other = 0, .sized = false};
            vec4 ball = light_tree_ball(rows);
            double probability = 1;
            do {
                const std::vector<LightTreeChild> children = light_tree_children(rows, way.index, ball);
                std::vector<double> importance;
                for (const LightTreeChild& child : children)
                    importance.push_back(shared::light_importance(child.bounds, position, normal, false));
                const double total = std::accumulate(importance.begin(), importance.end(), 0.0);
                probability *= total > 0 ? importance[trail & 3u] / total : 0;
                way = children[trail & 3u];
                ball = vec4(way.bounds.centre, way.bounds.radius);
                trail >>= 2;
            } while (!way.leaf && probability > 0);
            if (way.other != way.index) probability *= 0.5, ++pairs;
            EXPECT_TRUE(probability == 0 || (trail & 1u ? way.other : way.index) == k);
            EXPECT_NEAR(tabulated[r][k], probability, 1e-4 * probability + 1e-7) << r << ' ' << k;
        }
    }
    EXPECT_GT(pairs, 0) << "of one square's triangles";
}

/// Few point lights have a leaf each, so that their illuminance is exact but for the share of grazing light.
TEST_F(LightWays, IlluminanceOfFewLights) {
    Scene scene = many_lights(0, 4, 0);
    scene.environment.color = vec3(0.3f);
    const ShadingScene shading(scene);
    ASSERT_TRUE(shading.tables.needs.light_tree);
    const std::vector<vec4> at = receivers(kReceivers);
    const auto found = shading.run(kLibrary, R"(
        Receiver at = receiver_number(i);
        result[0] = vec4(light_tree_illuminance(at), environment_share(at), environment_illuminance(at.normal), 0.0);
    )",
                                   kReceivers, 1, at);
    for (std::uint32_t r = 0; r < kReceivers; ++r) {
        const dvec3 position(at[2 * r]), normal(at[2 * r + 1]);
        double lamps = 0;
        for (const PunctualLight& light : scene.lights) {
            if (light.type == LightType::directional) continue;
            const dvec3 to = light.position - shading.trace.origin - position;
            const double cosine = glm::dot(glm::normalize(to), normal);
            if (cosine > 0) lamps += luminance(light.intensity) * (0.05 + 0.95 * cosine) / glm::dot(to, to);
        }
        const double sky = kPi * 0.3;
        // Intensities are rounded to eight bits, places to 2^-15 of the root's ball.
        EXPECT_NEAR(found[r].x, lamps, 0.02 * lamps) << r;
        EXPECT_NEAR(found[r].y, lamps > 0 ? std::clamp(sky / (sky + lamps), 0.125, 0.875) : 1, 0.02) << r;
        EXPECT_NEAR(found[r].z, sky, 1e-5) << r;
    }

    // A direction of the sky has the density that rays which meet the sky there are weighted by.
    const auto densities = shading.run(kLibrary, R"(
        Receiver at = receiver_number(i);
        float worst = 0.0, skies = 0.0;
        for (uint n = 0u; n < 256u; ++n) {
            LightSample s = sample_light(at, SampleBits(hash_combine(hash_u32(i), n), hash_combine(hash_u32(n), i)));
            if (!s.at_infinity || s.pdf == 0.0) continue;
            skies += 1.0;
            worst = max(worst, abs(environment_pdf(at, s.direction) / s.pdf - 1.0));
        }
        result[0] = vec4(worst, skies, 0.0, 0.0);
    )",
                                       kReceivers, 1, at);
    for (const vec4& density : densities) {
        EXPECT_LT(density.x, 1e-4f);
        EXPECT_GT(density.y, 16);
    }
}

/// Compares the mean contribution of each selection with the sum over all lights.
TEST_F(LightWays, EverySelectionIsUnbiased) {
    const Scene scene = many_lights(0, 24, 40);
    constexpr std::uint32_t kStreams = 256;  // streams of 512 samples each; the largest standard error is 1.5 %
    std::vector<vec4> at = receivers(kReceivers);
    const TraceTables trace = build_trace_tables(scene);
    for (const LightChoice choice : {LightChoice::power, LightChoice::tree, LightChoice::uniform}) {
        SCOPED_TRACE(name(choice));
        const ShadingScene shading(scene, choice);
        const auto found = shading.run(kLibrary,
                                       R"(
            Receiver at = receiver_number(i / 256u);
            vec2 sums = vec2(0.0);
            for (uint n = 0u; n < 512u; ++n) {
                uint seed = hash_combine(hash_u32(i), n);
                LightSample s = sample_light(at, SampleBits(seed, 0u));
                float value = s.weight.x * max(dot(s.direction, at.normal), 0.0);
                sums += vec2(value, value * value);
            }
            result[0] = vec4(sums / 512.0, 0.0, 0.0);
        )",
                                       kReceivers * kStreams, 1, at);
        for (std::uint32_t r = 0; r < kReceivers; ++r) {
            const dvec3 position(at[2 * r]), normal(at[2 * r + 1]);
            double exact = 0;
            for (const PunctualLight& light : scene.lights)
                exact += test::irradiance(light, position + trace.origin, normal).x;
            double mean = 0, square = 0;
            for (std::uint32_t k = 0; k < kStreams; ++k) {
                mean += found[r * kStreams + k].x / kStreams;
                square += found[r * kStreams + k].y / kStreams;
            }
            const double error = std::sqrt((square - mean * mean) / (512.0 * kStreams));
            EXPECT_NEAR(mean, exact, 6 * error + 1e-5 * exact) << "receiver " << r;
            EXPECT_LT(error, 0.02 * exact) << "and reports it";
        }
    }
}

}  // namespace
}  // namespace halflight
