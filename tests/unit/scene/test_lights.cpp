// Tests light tables: which surfaces are lights, their probabilities, alias tables, and the cells of the environment.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <tuple>

#include "engine/tables/alias_table.h"
#include "engine/tables/environment_warp.h"
#include "engine/tables/light_textures.h"
#include "engine/tables/light_tree.h"
#include "engine/tables/lights.h"
#include "shaders/shared/environment_texels.h"
#include "shaders/shared/light.h"
#include "shaders/shared/light_tree_rows.h"
#include "shaders/shared/word.h"
#include "tests/support/error_message.h"

namespace halflight {
namespace {

void expect_exact(const std::vector<double>& weights) {
    const AliasTable table = build_alias_table(weights);
    ASSERT_EQ(table.entries.size(), weights.size());
    const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
    const auto count = static_cast<double>(weights.size());
    double total = 0;
    std::vector<double> picked(weights.size(), 0);
    for (const AliasEntry& entry : table.entries) {
        ASSERT_LT(entry.alias, weights.size());
        EXPECT_EQ(entry.threshold, std::round(entry.threshold * 0x1p24) * 0x1p-24);
        const auto i = static_cast<std::size_t>(&entry - table.entries.data());
        picked[i] += entry.threshold / count;
        picked[entry.alias] += (1 - double(entry.threshold)) / count;
    }
    for (std::size_t i = 0; i < weights.size(); ++i) {
        total += table.probabilities[i];
        EXPECT_DOUBLE_EQ(table.probabilities[i], picked[i]) << i;
        EXPECT_EQ(table.probabilities[i] > 0, weights[i] > 0) << i;
        // The tolerance is a step of 2^-24 of a column, for the entry itself and for each column that it fills up.
        EXPECT_NEAR(table.probabilities[i], weights[i] / sum, 0x1p-23 * (1 / count + weights[i] / sum)) << i;
    }
    EXPECT_NEAR(total, 1, 1e-12);
}

TEST(AliasTable, SelectsInProportionToWeights) {
    expect_exact({3.5});
    expect_exact(std::vector<double>(37, 0.1));
    expect_exact({0, 1, 0, 0, 2, 0});
    expect_exact({1e-30, 1, 1e-12, 5, 1e30});
    std::mt19937 random(3);
    std::vector<double> weights(10007);
    for (double& w : weights) w = random() % 5 == 0 ? 0.0 : std::pow(10.0, static_cast<double>(random() % 1000) / 100);
    expect_exact(weights);
}

/// Returns two triangles of area 1/2 and 2, the first of them dark, with `instances` copies along x.
Scene triangles(int instances) {
    Scene scene;
    scene.name = "triangles";
    scene.materials.resize(2);
    scene.materials[1].emission = vec3(3);
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 5}, {2, 0, 5}, {0, 2, 5}};
    mesh.normals.assign(6, vec3(0, 0, 1));
    mesh.uvs[0] = {{0, 0}, {1, 0}, {0, 1}, {0, 0}, {0.25f, 0}, {0, 0.25f}};
    mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
    mesh.triangle_material = {0, 1};
    scene.meshes = {mesh};
    for (int i = 0; i < instances; ++i) {
        Instance instance;
        instance.mesh = 0;
        instance.object_to_world[3] = dvec4(10 * i, 0, 0, 1);
        scene.instances.push_back(instance);
    }
    return scene;
}

LightTables lights_of(const Scene& scene, LightChoice choice = LightChoice::automatic) {
    return build_lights(scene, build_trace_tables(scene), choice);
}

TEST(Lights, DarkAndUnlitScenesHaveNone) {
    Scene dark = triangles(1), unlit = dark;
    dark.materials[1].emission = vec3(0);
    unlit.materials[1].unlit = true;
    EXPECT_TRUE(lights_of(unlit).rows.empty());
    const LightTables lights = lights_of(dark);
    EXPECT_TRUE(lights.rows.empty() && lights.alias.empty() && lights.light_of_triangle.empty());
    EXPECT_TRUE(lights.environment.pixels.empty() && lights.environment_warp.empty());
}

TEST(Lights, EmissiveTriangleOfMergedMesh) {
    const LightTables lights = lights_of(triangles(1));
    ASSERT_EQ(lights.rows.size(), std::size_t{shared::kLightStride});
    EXPECT_EQ(lights.light_of_triangle, (std::vector<std::uint32_t>{shared::kNoLight, 0}));
    EXPECT_EQ(shared::word_of_float(lights.rows[0].w), shared::kLightTriangle);
    EXPECT_EQ(shared::word_of_float(lights.rows[1].w), 1u);
    EXPECT_FLOAT_EQ(lights.rows[3].w, 1 / 2.0f);  // probability 1 over area 2
    EXPECT_GT(lights.rows[2].w, 0);
    EXPECT_LT(lights.rows[2].w, 1e-5f);
    EXPECT_EQ(vec3(lights.rows[1]), vec3(2, 0, 0));
    EXPECT_EQ(vec3(lights.rows[3]), vec3(3));
}

TEST(Lights, EveryInstanceOfASharedMeshIsALight) {
    const LightTables lights = lights_of(triangles(3), LightChoice::power);
    ASSERT_EQ(lights.triangle_count, 3u);
    EXPECT_EQ(lights.light_of_triangle, (std::vector<std::uint32_t>{shared::kNoLight, 0, 0, 1, 2}));
    for (std::size_t i = 0; i < 3; ++i) {
        const vec4* row = &lights.rows[i * shared::kLightStride];
        EXPECT_NEAR(row[3].w, 1 / 3.0 / 2.0, 1e-6);
        EXPECT_NEAR(row[0].x, 10.0 * double(i) - 11, 1e-5);  // the scene's centre is at x = 11
    }
}

TEST(Lights, KindsShareAQuarterAndPowerTheRest) {
    Scene scene = triangles(1);
    PunctualLight sun;
    sun.type = LightType::directional;
    sun.intensity = vec3(1000);
    PunctualLight bulb;
    bulb.position = dvec3(1, 1, 2.5);
    scene.lights = {bulb, sun};
    scene.environment.color = vec3(0.5f);
    const TraceTables trace = build_trace_tables(scene);
    const LightTables lights = build_lights(scene, trace, LightChoice::power);
    EXPECT_EQ(lights.triangle_count, 1u);
    EXPECT_EQ(lights.punctual_count, 2u);
    const double disk = kPi * 0.25 * double(glm::dot(trace.bounds.extent(), trace.bounds.extent()));
    const std::vector<double> power = {2 * kPi * 2 * 3, 4 * kPi, 1000 * disk, 0.5 * 4 * kPi * disk};
    const double total = std::accumulate(power.begin(), power.end(), 0.0);
    ASSERT_EQ(lights.probabilities.size(), 4u);
    for (std::size_t i = 0; i < 4; ++i)
        EXPECT_NEAR(lights.probabilities[i], 0.625 * power[i] / total + (0.25 + 0.125) / 4, 1e-6) << i;
    EXPECT_NEAR(lights.environment_warp[0].z, lights.probabilities[3], 1e-7);
    EXPECT_EQ(vec3(lights.environment_warp[1]), vec3(0.5f));
    EXPECT_NEAR(lights.environment_warp[1].w, 0.5 * kPi, 1e-6);
    EXPECT_EQ(lights.environment.width, 1);
    const vec4* row = &lights.rows[shared::kLightStride];
    EXPECT_EQ(shared::word_of_float(row[0].w), shared::kLightPoint);
    EXPECT_NEAR(glm::length(vec3(row[0]) - vec3(bulb.position - trace.origin)), 0, 1e-6);
}

TEST(Lights, EmissionTextureWeighsAndExcludes) {
    Scene scene = triangles(1);
    scene.materials[0].emission = vec3(1);
    TextureImage image{.name = "corner", .width = 64, .height = 64, .rgba = {}};
    image.rgba.edit().assign(4 * 64 * 64, 0);
    // The texture is bright in one corner, and only the first triangle's texture coordinates reach that corner.
    for (int y = 40; y < 60; ++y)
        for (int x = 2; x < 10; ++x) image.rgba.edit()[static_cast<std::size_t>(4 * (64 * y + x))] = 255;
    scene.images = {image};
    for (Material& m : scene.materials) {
        m.emission_texture.image = 0;
        m.emission_texture.wrap_u = m.emission_texture.wrap_v = Wrap::clamp_to_edge;
    }
    const LightTables lights = lights_of(scene);
    EXPECT_EQ(lights.light_of_triangle, (std::vector<std::uint32_t>{0, shared::kNoLight}));
    EXPECT_EQ(lights.triangle_count, 1u);
}

TEST(LuminanceSums, MeanOverWrappedBoxes) {
    TextureImage image{.name = "columns", .width = 32, .height = 8, .rgba = {}};
    for (int i = 0; i < 4 * 32 * 8; ++i) image.rgba.edit().push_back(i / 4 % 32 < 2 ? 255 : 0);  // two are white
    const LuminanceSums sums(image);
    TextureRef texture;
    texture.image = 0;
    const auto mean = [&](float u, Wrap wrap) {
        texture.wrap_u = wrap;
        return sums.mean(texture, {vec2(u, 0.2f), vec2(u + 0.01f, 0.2f), vec2(u, 0.8f)});
    };
    for (const Wrap wrap : {Wrap::repeat, Wrap::mirrored_repeat, Wrap::clamp_to_edge})
        EXPECT_TRUE(mean(0.01f, wrap) > 0 && mean(0.5f, wrap) == 0);
    EXPECT_GT(mean(0.99f, Wrap::repeat), 0);
    for (const float white : {1.97f, -0.02f}) EXPECT_GT(mean(white, Wrap::mirrored_repeat), 0) << white;
    for (const float black : {0.97f - 0.1f, 1.05f, -0.2f}) EXPECT_EQ(mean(black, Wrap::mirrored_repeat), 0) << black;
    EXPECT_TRUE(mean(-5, Wrap::clamp_to_edge) > 0 && mean(5, Wrap::clamp_to_edge) == 0);
    EXPECT_GT(mean(1e9f, Wrap::repeat), 0);  // all texels count if coordinates have no fraction left
    EXPECT_NEAR(sums.mean(texture, {vec2(0), vec2(1), vec2(0, 1)}), 2 / 32.0, 1e-6);
}

/// Returns the sum of the solid angles of all cells.
double sphere_of(const EnvironmentCells& cells) {
    return cells.columns * std::accumulate(cells.solid_angles.begin(), cells.solid_angles.end(), 0.0);
}

TEST(EnvironmentCells, IntegralAndPositivity) {
    Image map(40, 20, 3);
    for (int c = 0; c < 3; ++c) map.at(7, 5)[c] = 100;
    const EnvironmentCells cells = environment_cells(map);
    ASSERT_EQ(cells.columns, 40);
    ASSERT_EQ(cells.rows, 20);
    EXPECT_NEAR(sphere_of(cells), 4 * kPi, 1e-12);
    for (int y = 0; y < 20; ++y)
        for (int x = 0; x < 40; ++x) {
            // A bilinear lookup inside a cell reads the cell's texel and its eight neighbours.
            const bool lit = std::abs(x - 7) <= 1 && std::abs(y - 5) <= 1;
            EXPECT_EQ(cells.weights[static_cast<std::size_t>(y * 40 + x)] > 0, lit) << x << ' ' << y;
        }
    Image gray(16, 8, 3);
    for (float& p : gray.pixels) p = 2;
    EXPECT_NEAR(environment_cells(gray).integral, 8 * kPi, 1e-9);
}

TEST(EnvironmentCells, LargeMapsShareCells) {
    Image map(130, 61, 3);
    for (std::size_t i = 0; i < map.pixels.size(); ++i) map.pixels[i] = i % 7 == 0 ? 5.0f : 0.1f;
    const EnvironmentCells whole = environment_cells(map), few = environment_cells(map, 500);
    EXPECT_LE(few.columns * few.rows, 500);
    EXPECT_GT(few.columns * few.rows, 200);
    EXPECT_NEAR(few.integral, whole.integral, 1e-9 * whole.integral);
    EXPECT_NEAR(sphere_of(few), 4 * kPi, 1e-12);
    EXPECT_GT(std::ranges::min(few.weights), 0);
}

/// Returns the illuminance of a lobe, whose number is a cell of an octahedral map of normals.
double illuminance(const std::vector<vec4>& table, int lobe) {
    const int texels = shared::environment_lobe_texels(static_cast<int>(table[2].x));
    return table[static_cast<std::size_t>(static_cast<int>(table[1].w) + lobe * texels)].x;
}

TEST(EnvironmentWarp, LobesHaveTheIlluminanceOfTheirNormals) {
    Image map(64, 32, 3);
    for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 64; ++x)
            for (int k = 0; k < 3; ++k) map.at(x, y)[k] = 2;  // sky above black ground
    const EnvironmentCells cells = environment_cells(map);
    constexpr int kSide = shared::kEnvironmentLobes;
    for (const bool through : {false, true}) {
        const std::vector<vec4> table = environment_warp(cells, 0.5, through);
        // Normals are up to 15 degrees away. The octahedral map has +z in its middle and +y in the middle of its last
        // row.
        const double down = illuminance(table, kSide / 2), up = illuminance(table, (kSide - 1) * kSide + kSide / 2);
        EXPECT_NEAR(up, 2 * kPi, 0.1 * kPi);
        EXPECT_NEAR(down, through ? 2 * kPi : 0, 0.1 * kPi);
        EXPECT_NEAR(illuminance(table, kSide * kSide / 2 + kSide / 2), (through ? 2 : 1) * kPi, 0.4);
    }
}

/// Returns point lights in a row, with a sky if `sky` is set.
Scene bulbs(int count, bool sky) {
    Scene scene = triangles(1);
    scene.materials[1].emission = vec3(0);
    for (int i = 0; i < count; ++i) {
        PunctualLight& bulb = scene.lights.emplace_back();
        bulb.position = dvec3(i, 1, 0);
        bulb.intensity = vec3(i == 0 ? 1e8f : 1.0f + static_cast<float>(i));
    }
    if (sky) scene.environment.color = vec3(0.1f);
    return scene;
}

/// Adds a square, whose two triangles are one light for the receiver.
Scene with_square(Scene scene) {
    scene.materials[1].emission = vec3(3);
    Mesh& mesh = scene.meshes[0];
    mesh.triangles.emplace_back(5, 4, 6);
    mesh.triangle_material = {0, 1, 1};
    mesh.positions.emplace_back(2, 2, 5);
    mesh.normals.emplace_back(0, 0, 1);
    mesh.uvs[0].emplace_back(0, 0);
    return scene;
}

TEST(LightChoice, FewLightsAreAllSampledAndManyByATree) {
    using enum LightChoice;
    const std::tuple<Scene, LightChoice, LightChoice> cases[] = {
        {bulbs(1, false), automatic, power},  // nothing to choose among
        {bulbs(1, false), tree, power},
        {bulbs(1, false), all, power},
        {bulbs(0, true), automatic, power},
        {with_square(bulbs(0, false)), automatic, power},
        {bulbs(2, false), automatic, all},
        {bulbs(8, false), automatic, all},
        {bulbs(1, true), automatic, all},
        {bulbs(7, true), automatic, all},
        {with_square(bulbs(1, false)), automatic, all},
        {with_square(bulbs(0, true)), automatic, all},
        {bulbs(64, false), all, all},
        {bulbs(2, true), all, all},
        {bulbs(9, false), automatic, tree},
        {bulbs(8, true), automatic, tree},
        {with_square(bulbs(7, false)), automatic, tree},
        {bulbs(65, false), all, tree},
        {bulbs(2, true), tree, tree},
        {bulbs(16, true), power, power}};
    for (const auto& [scene, asked, expected] : cases) {
        SCOPED_TRACE(testing::Message() << scene.lights.size() << " lights, choice " << static_cast<int>(asked));
        const LightTables lights = lights_of(scene, asked);
        EXPECT_EQ(lights.choice, expected);
        EXPECT_EQ(lights.tree.empty(), expected != tree);
        if (expected != all || lights.triangle_count > 0) continue;
        EXPECT_FALSE(lights.needs.light_tree);
        EXPECT_EQ(lights.probabilities,
                  std::vector<double>(scene.lights.size() + (scene.environment.color.x > 0), 1.0));
        for (std::size_t i = 0; i < scene.lights.size(); ++i) EXPECT_EQ(lights.rows[i * shared::kLightStride + 3].w, 1);
        EXPECT_TRUE(lights.environment_warp.empty() || lights.environment_warp[0].z == 1);
    }
    for (const double p : lights_of(bulbs(20, true), uniform).probabilities) EXPECT_NEAR(p, 1 / 21.0, 1e-6);
}

TEST(LightChoice, RaysLookAtFewLightsOneByOne) {
    Scene many = bulbs(60001, false);
    for (PunctualLight& lamp : many.lights) lamp.radius = 0.01f;
    const auto refused = [&](LightChoice choice) { return error_message([&] { lights_of(many, choice); }); };
    EXPECT_NE(refused(LightChoice::power).find("60001 lights with a size"), std::string::npos);
    EXPECT_NE(refused(LightChoice::uniform), "");
    EXPECT_EQ(refused(LightChoice::tree), "");
    many.lights.pop_back();
    EXPECT_EQ(refused(LightChoice::power), "");
}

TEST(LightChoice, EachLightKeepsItsMinimumProbability) {
    for (const bool sky : {false, true}) {
        const LightTables tree = lights_of(bulbs(40, sky));
        ASSERT_EQ(tree.choice, LightChoice::tree);
        double sum = tree.tree_share;
        for (const double p : tree.probabilities) {
            EXPECT_NEAR(p, 0.125 / (sky ? 41 : 40), 1e-8);
            sum += p;
        }
        EXPECT_NEAR(sum, 1, 1e-9);
        for (std::size_t i = 0; i < 40; ++i) {
            const vec4* row = &tree.rows[i * shared::kLightStride];
            EXPECT_FLOAT_EQ(row[3].w, static_cast<float>(tree.probabilities[i]));
            EXPECT_EQ(shared::light_kind(shared::word_of_float(row[0].w)), shared::kLightPoint);
        }
        const shared::LightTreeHeader header = light_tree_header(tree.tree);
        EXPECT_NEAR(header.gain / (tree.tree_share / tree.probabilities[0]), 1, 1e-6);
        EXPECT_EQ(header.share, static_cast<float>(tree.tree_share));
    }
}

TEST(EnvironmentWarp, LevelsAddUpToTheWeightsOfTheirCells) {
    for (const ivec2 size : {ivec2(24, 12), ivec2(13, 7), ivec2(1, 1), ivec2(1, 9), ivec2(6, 1)}) {
        SCOPED_TRACE(size.x);
        Scene scene = triangles(1);
        scene.environment.color = vec3(1, 2, 0.5f);
        scene.environment.map = Image(size.x, size.y, 3);
        for (std::size_t i = 0; i < scene.environment.map.pixels.size(); ++i)
            scene.environment.map.pixels[i] = static_cast<float>(i * 37 % 11) + (i % 97 == 0 ? 500.0f : 0.0f);
        const LightTables lights = lights_of(scene);
        EXPECT_FLOAT_EQ(lights.environment.at(0, 0)[1], 2 * scene.environment.map.at(0, 0)[1]);
        const EnvironmentCells cells = environment_cells(lights.environment);
        const double whole = std::accumulate(cells.weights.begin(), cells.weights.end(), 0.0);
        const std::vector<vec4>& table = lights.environment_warp;
        EXPECT_FLOAT_EQ(table[0].z, static_cast<float>(lights.probabilities.back()));
        const int levels = static_cast<int>(table[0].w);
        std::size_t first = shared::kEnvironmentFirstNode;
        for (int below = levels; below > 0; --below) {
            const ivec2 nodes = (size + (1 << below) - 1) >> below;
            if (below == 1) {
                EXPECT_EQ(table[1].y, static_cast<float>(first));
            }
            double sum = 0;
            for (int y = 0; y < 2 * nodes.y; ++y)
                for (int x = 0; x < 2 * nodes.x; ++x) {
                    const vec4 node = table[first + static_cast<std::size_t>(y / 2 * nodes.x + x / 2)];
                    double expected = 0;  // sum of all cells below the child
                    for (int v = y << (below - 1); v < std::min((y + 1) << (below - 1), size.y); ++v)
                        for (int u = x << (below - 1); u < std::min((x + 1) << (below - 1), size.x); ++u)
                            expected += cells.weights[static_cast<std::size_t>(v * size.x + u)] / whole;
                    EXPECT_NEAR(node[2 * (y % 2) + x % 2], expected, 1e-6 * expected) << below << ' ' << x << ' ' << y;
                    sum += double(node[2 * (y % 2) + x % 2]);
                }
            EXPECT_NEAR(sum, 1, 1e-6);
            first += static_cast<std::size_t>(nodes.x * nodes.y);
        }
        EXPECT_EQ(table[1].w, static_cast<float>(first));
        constexpr std::size_t kLobes = shared::kEnvironmentLobes * shared::kEnvironmentLobes + 1;
        const auto texels = static_cast<std::size_t>(shared::environment_lobe_texels(static_cast<int>(table[2].x)));
        ASSERT_EQ(table.size(), first + kLobes * texels);
        const double solid = double(table[1].x) * std::sin(kPi * 0.5 / size.y);
        EXPECT_NEAR(solid, cells.solid_angles[0], 1e-6 * solid);
    }
}

}  // namespace
}  // namespace halflight
