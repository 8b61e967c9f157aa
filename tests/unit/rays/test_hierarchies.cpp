// Tests hierarchies of animated scenes: reuse, refit, rebuild, and independence from intermediate poses.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include "engine/rays/packed_bvh.h"
#include "engine/rays/refit.h"
#include "tests/support/random_rings.h"
#include "tests/support/scenes.h"

namespace halflight::rays {
namespace {

using test::random_rings;

/// Returns the bounds below a node. Checks that every box is the exact bounds of its contents.
Bounds check_boxes(const Bvh& bvh, const std::vector<Ring>& rings, std::uint32_t node, std::size_t& pairs) {
    Bounds all;
    for (const BvhChild& child : bvh.nodes[node].children) {
        if (child.bounds.empty()) continue;
        Bounds box;
        if (!child.leaf()) box = check_boxes(bvh, rings, child.first, pairs);
        for (std::uint32_t i = child.first; i < child.first + child.count; ++i) {
            for (const vec3& p : rings[bvh.primitives[i]]) box.add(p);
            ++pairs;
        }
        EXPECT_EQ(box.lower, child.bounds.lower);
        EXPECT_EQ(box.upper, child.bounds.upper);
        all.add(box);
    }
    return all;
}

TEST(Refit, BoxesAreExact) {
    for (const std::size_t count : {1u, 5u, 3000u}) {
        const std::vector<Ring> rings = random_rings(count, 0.1f, 1), moved = random_rings(count, 0.3f, 2);
        Bvh bvh = build_pair_bvh(rings, Splits::none);
        std::size_t pairs = 0;
        check_boxes(bvh, rings, 0, pairs);
        for (const auto& now : {moved, rings}) {
            refit(bvh, now);
            check_boxes(bvh, now, 0, pairs);
        }
        EXPECT_EQ(pairs, 3 * count) << "each once";
    }
    Bvh nothing;
    EXPECT_NO_THROW(refit(nothing, {}));
}

TEST(Refit, CostIsRelativeArea) {
    // Two unit cubes with 2 and 3 pairs are in the corners of a 2x1x1 box. The box has area 10, a cube 6.
    Bvh bvh;
    bvh.nodes.emplace_back();
    bvh.nodes[0].children[0] = {{vec3(0), vec3(1)}, 0, 2};
    bvh.nodes[0].children[1] = {{vec3(1, 0, 0), vec3(2, 1, 1)}, 2, 3};
    EXPECT_DOUBLE_EQ(expected_cost(bvh), 1 + 0.6 * 2 + 0.6 * 3);
    EXPECT_EQ(expected_cost(Bvh{}), 0);
    // The two halves of a line of pairs change places, so disjoint boxes all grow to the whole line.
    std::vector<Ring> line, shuffled;
    for (int i = 0; i < 256; ++i) {
        const auto at = [](int x) { return Ring{vec3(x, 0, 0), vec3(x + 1, 0, 1), vec3(x + 1, 1, 0), vec3(x, 1, 1)}; };
        line.push_back(at(i));
        shuffled.push_back(at((i * 77) % 256));
    }
    Bvh shape = build_pair_bvh(line, Splits::none);
    const double before = expected_cost(shape);
    refit(shape, shuffled);
    EXPECT_GT(expected_cost(shape), 3 * before);
    EXPECT_LT(expected_cost(build_pair_bvh(shuffled, Splits::none)), 1.2 * before);
}

/// Function that returns the deformed position of a vertex, given the vertex and the centre of its tile.
using Bend = std::function<vec3(const vec3&, const vec3&)>;

/// Adds a wavy sheet of n x n tiles around `centre`, with gaps between the tiles.
int add_sheet(Scene& scene, int n, const vec3& centre, const Bend& bend) {
    Mesh mesh;
    const auto at = [&](float x, float y) {
        const vec2 p = 2.0f * vec2(x, y) / float(n) - 1.0f;
        return vec3(p.x, 0.2f * std::sin(5 * p.x) * std::cos(4 * p.y), p.y);
    };
    for (int y = 0; y < n; ++y)
        for (int x = 0; x < n; ++x) {
            const auto a = static_cast<std::uint32_t>(mesh.positions.size());
            const vec3 middle = at(float(x) + 0.5f, float(y) + 0.5f);
            for (const ivec2& c : {ivec2(0, 0), ivec2(0, 1), ivec2(1, 1), ivec2(1, 0)})
                mesh.positions.push_back(bend(glm::mix(middle, at(float(x + c.x), float(y + c.y)), 0.95f), middle) +
                                         centre);
            mesh.triangles.insert(mesh.triangles.end(), {uvec3(a, a + 1, a + 2), uvec3(a, a + 2, a + 3)});
        }
    mesh.normals.assign(mesh.positions.size(), vec3(0, 1, 0));
    mesh.triangle_material.assign(mesh.triangles.size(), 0);
    const int index = static_cast<int>(scene.meshes.size());
    scene.meshes.push_back(std::move(mesh));
    scene.instances.emplace_back().mesh = index;
    return index;
}

vec3 as_it_is(const vec3& p, const vec3&) {
    return p;
}

/// Returns a static floor, a sheet that deforms, a box that its instance moves, and a static and a moving instance of
/// one sheet, in this order.
Scene pose(const Bend& bend, const dvec3& step = dvec3(0)) {
    Scene scene;
    scene.materials.emplace_back();
    const int floor = add_sheet(scene, 12, {0, -1, 0}, as_it_is);
    scene.meshes[static_cast<std::size_t>(floor)].deforms = false;
    scene.meshes[static_cast<std::size_t>(add_sheet(scene, 10, {0, 0, 0}, bend))].deforms = true;
    test::add_box(scene, 0, {2, 0, 0}, {3, 1, 1});
    scene.instances.back().moves = true;
    scene.instances.back().object_to_world = glm::translate(dmat4(1), step);
    const int shared = add_sheet(scene, 6, {0, 2, 0}, as_it_is);
    scene.instances.push_back(scene.instances.back());
    scene.instances.back().mesh = shared;
    scene.instances.back().moves = true;
    scene.instances.back().object_to_world = glm::translate(dmat4(1), dvec3(4, 0, 0) + step);
    return scene;
}

TraceTables tables_of(const Scene& scene) {
    return build_trace_tables(scene, 0, dvec3(0));
}

vec3 lean(const vec3& p, const vec3&) {
    return {p.x + 0.2f * p.z, p.y + 0.3f * p.x * p.x, p.z};
}

/// Permutes rows and columns of ten by ten tiles, so that neighbours end three tiles apart.
vec3 torn(const vec3& p, const vec3& middle) {
    const auto step = [](float x) {
        const auto place = std::lround((x + 1) * 5 - 0.5f);
        return float(3 * place % 10 - place) / 5;
    };
    return p + vec3(step(middle.x), 0, step(middle.z));
}

bool same(const PackedScene& a, const PackedScene& b) {
    const auto bits = [](const vec4& x, const vec4& y) { return std::memcmp(&x, &y, sizeof(x)) == 0; };
    return a.format == b.format && a.two_level == b.two_level && a.nodes == b.nodes &&
           std::ranges::equal(a.pairs, b.pairs, bits) && a.instance_head == b.instance_head &&
           a.stack_entries == b.stack_entries;
}

TEST(Parts, StaticAndMovingPartsAreSeparate) {
    const TraceTables tables = tables_of(pose(as_it_is));
    const std::vector<Part> parts = parts_of(tables);
    ASSERT_EQ(parts.size(), 4u) << "floor; sheet; box; the block of the shared sheet";
    const bool moves[] = {false, true, true, false};
    const std::size_t triangles[] = {288, 200, 12, 72};
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_EQ(parts[i].moves, moves[i]) << i;
        EXPECT_EQ(parts[i].block, i < 3 ? 0u : 1u) << i;
        EXPECT_EQ(triangles_of(parts[i]).size(), triangles[i]) << i;
    }
    // All instances are in one block, because the static ones surround the moving ones.
    const std::vector<Part> flat = parts_of(build_trace_tables(pose(as_it_is), 1000));
    ASSERT_EQ(flat.size(), 4u) << "and an instance of the sheet that moves";
    EXPECT_EQ(triangles_of(flat[0]).size(), 288u + 72u);
    EXPECT_EQ(flat[0].spans.size(), 2u);
}

TEST(Parts, LargeStaticPartsAreCut) {
    const TraceTables tables = tables_of(pose(as_it_is));
    const Hierarchies kept(tables, 50);
    std::vector<std::uint32_t> all, again;
    for (const Part& part : parts_of(tables)) std::ranges::copy(triangles_of(part), std::back_inserter(all));
    for (const Part& part : kept.parts()) {
        const std::vector<std::uint32_t> triangles = triangles_of(part);
        if (!part.moves) {
            EXPECT_LE(triangles.size(), 50u);
        }
        EXPECT_TRUE(std::ranges::is_sorted(triangles));
        std::ranges::copy(triangles, std::back_inserter(again));
    }
    EXPECT_EQ(kept.parts().size(), 2u + 8u + 2u) << "288 and 72 static triangles, two moving parts";
    std::ranges::sort(all), std::ranges::sort(again);
    EXPECT_EQ(all, again);
    EXPECT_TRUE(same(pack_scene(tables, Hierarchies(tables, 50)), pack_scene(tables, Hierarchies(tables, 50))));
    EXPECT_TRUE(same(pack_scene(tables, kept), pack_scene(tables, Hierarchies(tables, 50)))) << "freed while packed";

    const TraceTables bent = tables_of(pose(lean));
    Hierarchies h(tables, 50);
    h.update(tables, bent);
    EXPECT_EQ(h.counts(), (HierarchyCounts{.kept = 11, .refitted = 1})) << "the sheet";
    h.update(bent, tables);
    EXPECT_TRUE(same(pack_scene(tables, h), pack_scene(tables, kept)));
}

TEST(Hierarchies, AreKeptRefittedOrRebuilt) {
    const TraceTables reference = tables_of(pose(as_it_is)), bent = tables_of(pose(lean)),
                      apart = tables_of(pose(torn)), stepped = tables_of(pose(lean, {0.5, 0, 0}));
    Hierarchies h(reference);
    EXPECT_EQ(h.counts(), (HierarchyCounts{.built = 4}));
    const std::pair<const TraceTables*, HierarchyCounts> steps[] = {
        {&reference, {.kept = 4}},
        {&bent, {.kept = 3, .refitted = 1}},               // the sheet
        {&stepped, {.kept = 3, .refitted = 1}},            // the box; an instance is no hierarchy
        {&apart, {.kept = 2, .refitted = 1, .built = 1}},  // the sheet, torn; the box back
        {&reference, {.kept = 3, .refitted = 1}}};         // the shape of the reference pose again
    const TraceTables* before = &reference;
    for (const auto& [next, counts] : steps) {
        h.update(*before, *next);
        EXPECT_EQ(h.counts(), counts);
        before = next;
    }

    // The hierarchy rebuilt for the torn sheet fits it better than the reference pose.
    Hierarchies other(reference);
    std::vector<Corners> corners;
    for (const std::uint32_t t : triangles_of(other.parts()[1])) {
        const uvec4& c = apart.triangles[t];
        corners.push_back({apart.positions[c.x], apart.positions[c.y], apart.positions[c.z]});
    }
    std::vector<Ring> rings;
    for (const TrianglePair& pair : other.trees()[1].pairs) rings.push_back(ring_of(pair, corners));
    Bvh shape = other.trees()[1].bvh;
    refit(shape, rings);
    other.update(reference, apart);
    EXPECT_LT(expected_cost(other.trees()[1].bvh), 0.9 * expected_cost(shape));
}

TEST(Hierarchies, IntermediatePosesLeaveNoTrace) {
    const Bend bends[] = {as_it_is, lean, torn, [](const vec3& p, const vec3&) { return 0.5f * p; }};
    std::vector<TraceTables> poses;
    for (const Bend& bend : bends)
        for (const double step : {0.0, 7.0}) poses.push_back(tables_of(pose(bend, {step, 0, step})));
    std::vector<PackedScene> alone;
    for (const TraceTables& tables : poses) {
        Hierarchies h(poses[0]);
        h.update(poses[0], tables);
        alone.push_back(pack_scene(tables, h));
    }
    EXPECT_FALSE(same(alone[0], alone[1]));
    EXPECT_TRUE(same(alone[0], pack_scene(poses[0])));
    Hierarchies h(poses[0]);
    std::mt19937 random(1);
    std::size_t last = 0;
    for (int i = 0; i < 40; ++i) {
        const std::size_t next = random() % poses.size();
        h.update(poses[last], poses[next]);
        EXPECT_TRUE(same(pack_scene(poses[next], h), alone[next])) << last << " to " << next;
        last = next;
    }
}

TEST(Hierarchies, PairsThatSeparateAreRebuilt) {
    // The two triangles of a tile share positions but no vertices, and then separate.
    const auto soup = [](float apart) {
        Scene scene = pose(as_it_is);
        Mesh& mesh = scene.meshes[1];
        const std::vector<vec3> shared = mesh.positions;
        mesh.positions.clear();
        for (uvec3& t : mesh.triangles) {
            const auto first = static_cast<std::uint32_t>(mesh.positions.size());
            for (int k = 0; k < 3; ++k) mesh.positions.push_back(shared[t[k]] + apart * vec3(float(first % 2), 0, 0));
            t = {first, first + 1, first + 2};
        }
        mesh.normals.assign(mesh.positions.size(), vec3(0, 1, 0));
        return tables_of(scene);
    };
    const TraceTables whole = soup(0), gaping = soup(0.01f);
    Hierarchies h(whole);
    EXPECT_LT(h.trees()[1].pairs.size(), 200u);
    h.update(whole, gaping);
    EXPECT_EQ(h.counts(), (HierarchyCounts{.kept = 3, .built = 1}));
    EXPECT_TRUE(same(pack_scene(gaping, h), pack_scene(gaping)));
}

TEST(Hierarchies, InstancesMayAppearAndDisappear) {
    Scene without = pose(lean);
    without.meshes[1].triangles.resize(150);
    without.meshes[1].triangle_material.resize(150);
    const TraceTables reference = tables_of(pose(as_it_is)), less = tables_of(without);
    without.instances.erase(without.instances.begin() + 2);
    const TraceTables gone = tables_of(without);
    Hierarchies h(reference), cut(reference, 50);
    h.update(reference, less);
    EXPECT_EQ(h.counts(), (HierarchyCounts{.kept = 3, .built = 1})) << "other triangles than the shape's";
    EXPECT_TRUE(same(pack_scene(less, h), pack_scene(less)));
    cut.update(reference, less);
    EXPECT_EQ(cut.counts(), (HierarchyCounts{.kept = 11, .built = 1}));
    EXPECT_TRUE(same(pack_scene(less, cut), pack_scene(less, Hierarchies(less, 50))));
    h.update(less, gone);
    EXPECT_EQ(h.parts().size(), 3u);
    h.update(gone, reference);
    EXPECT_TRUE(same(pack_scene(reference, h), pack_scene(reference)));
}

}  // namespace
}  // namespace halflight::rays
