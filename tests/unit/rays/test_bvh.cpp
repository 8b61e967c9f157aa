// Tests the merging of triangles into pairs, and hierarchies on the CPU, before they are uploaded.
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <functional>
#include <map>
#include <numeric>
#include <random>
#include <set>

#include "engine/rays/native_tree.h"
#include "engine/rays/packed_bvh.h"
#include "engine/rays/pairs.h"
#include "shaders/shared/bvh_nodes.h"
#include "tests/support/random_rings.h"

namespace halflight::rays {
namespace {

/// Checks that every triangle is in one pair, and that the corners of rings match. Returns the number of triangles left
/// single.
std::size_t check(const std::vector<Corners>& triangles) {
    std::vector<int> seen(triangles.size());
    std::size_t alone = 0;
    for (const TrianglePair& pair : pair_triangles(triangles)) {
        const auto [a, b] = pair.triangles;
        EXPECT_LE(a, b);
        ++seen[a];
        a == b ? ++alone : static_cast<std::size_t>(++seen[b]);
        const Ring ring = ring_of(pair, triangles);
        for (int which = 0; which < 2; ++which) {
            const Corners& t = triangles[pair.triangles[static_cast<std::size_t>(which)]];
            const auto [start, end, apex] = corners_in_pair(pair, which);
            EXPECT_EQ(start + end + apex, 3);
            EXPECT_EQ(t[start], ring[0]);
            EXPECT_EQ(t[end], ring[2]);
            EXPECT_EQ(t[apex], ring[which == 0 ? 1 : 3]);
        }
    }
    EXPECT_TRUE(std::ranges::all_of(seen, [](int n) { return n == 1; }));
    return alone;
}

/// Returns `n` squares of two triangles each, side by side.
std::vector<Corners> squares(int n) {
    std::vector<Corners> triangles;
    for (int y = 0; y < n; ++y)
        for (int x = 0; x < n; ++x) {
            const vec3 a(x, y, 0), b(x + 1, y, 0), c(x + 1, y + 1, 0), d(x, y + 1, 0);
            triangles.push_back({a, b, c});
            triangles.push_back({a, c, d});
        }
    return triangles;
}

TEST(Pairs, HalvesOfASquareArePaired) {
    const std::vector<Corners> triangles = squares(20);
    EXPECT_EQ(check(triangles), 0u);
    for (const TrianglePair& pair : pair_triangles(triangles)) {
        EXPECT_EQ(pair.triangles[0] % 2, 0u);
        EXPECT_EQ(pair.triangles[1], pair.triangles[0] + 1);
    }
}

TEST(Pairs, AnyOrderOfTrianglesAndCorners) {
    std::vector<Corners> triangles = squares(40);
    std::mt19937 random(1);
    std::ranges::shuffle(triangles, random);
    for (Corners& t : triangles) std::ranges::shuffle(t, random);
    EXPECT_LT(check(triangles), triangles.size() / 10);  // the hash table evicts some edges
}

TEST(Pairs, TrianglesWithoutACommonEdgeStayAlone) {
    std::mt19937 random(2);
    std::uniform_real_distribution<float> uniform(-1, 1);
    std::vector<Corners> triangles(500);
    for (Corners& t : triangles)
        for (vec3& p : t) p = vec3(uniform(random), uniform(random), uniform(random));
    EXPECT_EQ(check(triangles), triangles.size());
    EXPECT_EQ(check({}), 0u);
}

TEST(Pairs, WallsThatMeetInACornerStayApart) {
    const vec3 a(0), b(0, 0, 1), c(1, 0, 0), d(0, 1, 0);
    EXPECT_EQ(check({{a, b, c}, {a, b, d}}), 2u);
    EXPECT_EQ(check({{a, b, c}, {b, a, vec3(-1, 0, 0)}}), 0u);
}

TEST(Pairs, DegenerateAndCoincidentTriangles) {
    check(std::vector<Corners>(50, Corners{vec3(1), vec3(1), vec3(1)}));
    check(std::vector<Corners>(50, Corners{vec3(0), vec3(1, 0, 0), vec3(1, 0, 0)}));
    EXPECT_EQ(check(std::vector<Corners>(50, Corners{vec3(0), vec3(1, 0, 0), vec3(0, 1, 0)})), 0u);
}

using test::random_rings;

template <class Points>
Bounds box_of(const Points& points) {
    Bounds box;
    for (const vec3& p : points) box.add(p);
    return box;
}

bool inside(const Bounds& inner, const Bounds& outer) {
    return glm::all(glm::greaterThanEqual(inner.lower, outer.lower)) &&
           glm::all(glm::lessThanEqual(inner.upper, outer.upper));
}

/// Calls f(child) for all children below a node, and checks that boxes are nested. Returns the stack entries needed.
std::uint32_t walk(const Bvh& bvh, std::uint32_t index, const Bounds& around,
                   const std::function<void(const BvhChild&)>& f) {
    const BvhNode& node = bvh.nodes[index];
    const auto children = static_cast<std::uint32_t>(node.child_count());
    std::uint32_t below = 0;
    for (std::uint32_t i = 0; i < children; ++i) {
        const BvhChild& child = node.children[i];
        EXPECT_TRUE(inside(child.bounds, around));
        f(child);
        if (!child.leaf()) below = std::max(below, walk(bvh, child.first, child.bounds, f));
    }
    return below + children - 1;
}

void check_rings(const std::vector<Ring>& rings) {
    const Bvh bvh = build_pair_bvh(rings);
    Bounds all;
    for (const Ring& ring : rings) all.add(box_of(ring));
    std::vector<std::vector<Bounds>> parts(rings.size());
    std::size_t entries = 0;
    const std::uint32_t stack = walk(bvh, 0, all, [&](const BvhChild& child) {
        if (!child.leaf()) return;
        EXPECT_LE(child.count, kMaxLeafPrimitives);
        entries += child.count;
        for (std::uint32_t i = child.first; i < child.first + child.count; ++i)
            parts[bvh.primitives[i]].push_back(child.bounds);
    });
    EXPECT_EQ(stack, bvh.stack_entries);
    EXPECT_EQ(entries, bvh.primitives.size());
    EXPECT_LE(entries, static_cast<std::size_t>(kSplitBudget * static_cast<double>(rings.size())) + 1);

    // Each point of a pair is in a leaf that lists the pair.
    std::mt19937 random(7);
    std::uniform_real_distribution<double> uniform(0, 1);
    std::size_t outside = 0;
    for (std::size_t i = 0; i < rings.size(); ++i) {
        for (int sample = 0; sample < 40; ++sample) {
            const double r = std::sqrt(uniform(random)), u = r * uniform(random);
            const std::size_t first = sample % 2 == 0 ? 0 : 2;  // first corner of one of the two triangles
            const vec3 &a = rings[i][first], &b = rings[i][first + 1], &c = rings[i][2 - first];
            const dvec3 p = (1 - r) * dvec3(a) + u * dvec3(b) + (r - u) * dvec3(c);
            outside += std::none_of(parts[i].begin(), parts[i].end(), [&](const Bounds& box) {
                return glm::all(glm::greaterThanEqual(p, dvec3(box.lower) - 1e-15)) &&
                       glm::all(glm::lessThanEqual(p, dvec3(box.upper) + 1e-15));
            });
        }
    }
    EXPECT_EQ(outside, 0u);
}

TEST(Bvh, HoldsEveryPair) {
    check_rings(random_rings(3000, 0.02f, 1));
    check_rings(random_rings(3000, 0.7f, 2));  // many splits
    for (const std::size_t count : {1u, 4u, 5u}) check_rings(random_rings(count, 1, 3));
    check_rings(std::vector<Ring>(5000, Ring{vec3(0), vec3(1, 0, 0), vec3(1, 1, 0), vec3(0, 1, 0)}));
    check_rings(std::vector<Ring>(5000, Ring{vec3(0.5f), vec3(0.5f), vec3(0.5f), vec3(0.5f)}));
    std::vector<Ring> flat = random_rings(3000, 0.3f, 6);
    for (Ring& ring : flat)
        for (vec3& p : ring) p.y = 0.25f;
    check_rings(flat);
}

TEST(Bvh, BoxHierarchyHasOneBoxPerLeaf) {
    std::vector<Bounds> boxes;
    for (const Ring& ring : random_rings(500, 0.3f, 8)) boxes.push_back(box_of(ring));
    const Bvh bvh = build_bvh(boxes);
    std::set<std::uint32_t> seen;
    walk(bvh, 0, {vec3(-10), vec3(10)}, [&](const BvhChild& child) {
        if (!child.leaf()) return;
        EXPECT_EQ(child.count, 1u);
        EXPECT_TRUE(inside(boxes[bvh.primitives[child.first]], child.bounds));
        EXPECT_TRUE(seen.insert(bvh.primitives[child.first]).second);
    });
    EXPECT_EQ(seen.size(), boxes.size());
    EXPECT_TRUE(build_bvh({}).nodes.empty() && build_pair_bvh({}).nodes.empty());
}

bool same(const Bvh& a, const Bvh& b) {
    return a.primitives == b.primitives && a.nodes.size() == b.nodes.size() &&
           std::memcmp(a.nodes.data(), b.nodes.data(), a.nodes.size() * sizeof(BvhNode)) == 0;
}

TEST(Bvh, IsTheSameWithAnyNumberOfThreads) {
    const std::vector<Ring> rings = random_rings(8000, 0.1f, 9);
    const Bvh reference = build_pair_bvh(rings);
    for (const int threads : {1, 2}) {
        tbb::task_arena arena(threads);
        arena.execute([&] { EXPECT_TRUE(same(reference, build_pair_bvh(rings))) << threads; });
    }
}

/// Returns tables of pairs; every third pair has only its first triangle.
TraceTables tables_of(const std::vector<Ring>& rings) {
    TraceTables tables;
    Block block;
    for (const Ring& ring : rings) {
        const auto first = static_cast<std::uint32_t>(tables.positions.size());
        tables.positions.insert(tables.positions.end(), ring.begin(), ring.end());
        tables.triangles.emplace_back(first, first + 1, first + 2, 0);
        if (first % 12 != 0) tables.triangles.emplace_back(first, first + 2, first + 3, 0);
        block.bounds.add(box_of(ring));
    }
    block.triangle_count = static_cast<std::uint32_t>(tables.triangles.size());
    tables.bounds = block.bounds;
    tables.blocks = {block};
    tables.instances.emplace_back().identity = true;
    return tables;
}

/// Returns the bounds of child k of a node in a packed scene, decoded as the kernels do.
Bounds decoded(const PackedScene& packed, std::size_t node, int k) {
    const auto as_float = [](std::uint32_t word) { return std::bit_cast<float>(word); };
    Bounds box;
    if (packed.format == NodeFormat::floating) {
        const uvec4* texels = &packed.nodes[node * shared::kBvhFloatTexels];
        for (int a = 0; a < 3; ++a) {
            box.lower[a] = as_float(texels[2 * a][k]);
            box.upper[a] = as_float(texels[2 * a + 1][k]);
        }
        return box;
    }
    const uvec4* texels = &packed.nodes[node * shared::kBvhGridTexels];
    for (int a = 0; a < 3; ++a) {
        const double base = as_float(packed.nodes[0][a]), cell = as_float(packed.nodes[1][a]);
        const auto at = [&](int word) { return base + cell * ((texels[a][word] >> (16 * (k % 2))) & 0xffffu); };
        box.lower[a] = static_cast<float>(at(k / 2));
        box.upper[a] = static_cast<float>(at(2 + k / 2));
    }
    return box;
}

/// Checks the first (0) or second (1) triangle of a pair, and returns its id.
std::uint32_t check_triangle(const TraceTables& tables, const PackedScene& packed, std::size_t slot, int which) {
    const vec4* texels = &packed.pairs[shared::kBvhPairTexels * slot];
    const auto word = [&](int i) { return std::bit_cast<std::uint32_t>(texels[3][i]); };
    const std::uint32_t id = word(which) & shared::kBvhTriangleMask;
    const std::uint32_t order = word(2) >> (which * shared::kBvhOrderShift);
    const int second = order & 3, third = (order >> 2) & 3;
    const int places[] = {3 - second - third, second, third};
    for (int c = 0; c < 3; ++c) {
        const int ring_corner = places[c] == 2 ? (which == 0 ? 1 : 3) : 2 * places[c];
        const vec3 expected = tables.positions.at(tables.triangles.at(id)[c]);
        for (int a = 0; a < 3; ++a) EXPECT_EQ(texels[a][ring_corner], expected[a]);
    }
    EXPECT_LE(word(0) & shared::kBvhTriangleMask, word(1) & shared::kBvhTriangleMask);
    return id;
}

class Packed : public ::testing::TestWithParam<NodeFormat> {};

TEST_P(Packed, BoxesContainWhatTheyHold) {
    for (const float size : {0.01f, 0.5f}) {
        const TraceTables tables = tables_of(random_rings(1500, size, 10));
        const PackedScene packed = pack_scene(tables, GetParam());
        const std::size_t stride = GetParam() == NodeFormat::grid ? shared::kBvhGridTexels : shared::kBvhFloatTexels;
        std::vector<Bounds> seen(tables.triangles.size());
        std::vector<std::size_t> open{1};
        std::vector<Bounds> around{tables.bounds};
        std::size_t nodes = 0;
        const float rounding = 1e-6f;  // rounding of decoded() in single precision
        while (!open.empty()) {
            const std::size_t node = open.back();
            const Bounds outer = around.back();
            open.pop_back(), around.pop_back();
            ++nodes;
            for (int k = 0; k < 4; ++k) {
                const std::uint32_t reference = packed.nodes[node * stride + stride / 4 * 3][k];
                EXPECT_EQ(reference & 0xc0000000u, shared::kBvhTag);
                if (reference == shared::kBvhNoChild) continue;
                const Bounds box = decoded(packed, node, k);
                if (nodes > 1) {
                    EXPECT_TRUE(inside(box, {outer.lower - rounding, outer.upper + rounding}));
                }
                if ((reference & shared::kBvhLeaf) == 0) {
                    open.push_back(reference & shared::kBvhIndexMask), around.push_back(box);
                    continue;
                }
                const std::uint32_t first = reference & shared::kBvhIndexMask;
                const std::uint32_t count = (reference >> shared::kBvhCountShift) & 7u;
                ASSERT_TRUE(count >= 1 && count <= kMaxLeafPrimitives);
                for (std::uint32_t slot = first; slot < first + count; ++slot)
                    for (int which = 0; which < 2; ++which) seen[check_triangle(tables, packed, slot, which)].add(box);
            }
        }
        EXPECT_EQ(nodes, packed.node_count);
        for (std::size_t i = 0; i < seen.size(); ++i) {
            Bounds box;
            for (int c = 0; c < 3; ++c) box.add(tables.positions[tables.triangles[i][c]]);
            EXPECT_TRUE(inside(box, {seen[i].lower - rounding, seen[i].upper + rounding})) << i;
        }
    }
}
INSTANTIATE_TEST_SUITE_P(Formats, Packed, ::testing::Values(NodeFormat::grid, NodeFormat::floating));

/// Returns the leaves of eight-wide nodes with their boxes. Checks that each box of an inner node contains its
/// children.
template <class Bound>
std::map<std::uint32_t, std::array<float, 6>> leaves_of(const std::vector<NativeNode<Bound>>& nodes) {
    std::map<std::uint32_t, std::array<float, 6>> leaves;
    const std::function<void(std::uint32_t, const float*)> visit = [&](std::uint32_t node, const float* outer) {
        for (std::size_t i = 0; i < kNativeWidth; ++i) {
            const std::uint32_t reference = nodes.at(node).reference[i];
            if (reference == shared::kBvhNoChild) continue;
            std::array<float, 6> box;
            for (std::size_t b = 0; b < 6; ++b) {
                box[b] = static_cast<float>(nodes[node].bounds[b][i]);
                if (outer != nullptr) {
                    EXPECT_TRUE(b % 2 == 0 ? box[b] >= outer[b] : box[b] <= outer[b]);
                }
            }
            if (shared::is_leaf(reference)) {
                EXPECT_TRUE(leaves.emplace(reference, box).second) << "twice";
            } else {
                visit(reference & shared::kBvhIndexMask, box.data());
            }
        }
    };
    visit(0, nullptr);
    return leaves;
}

TEST_P(Packed, EightWideNodesHaveTheSameLeavesAndSixChildrenInTheMean) {
    for (const std::size_t count : {1u, 3u, 3000u}) {
        const TraceTables tables = tables_of(random_rings(count, 0.1f, 12));
        const PackedScene packed = pack_scene(tables, GetParam());
        const NativeTree tree =
            build_native_tree(tables, packed.format, packed.two_level, packed.nodes, packed.instance_head);
        const bool grid = GetParam() == NodeFormat::grid;
        const auto leaves = grid ? leaves_of(tree.grid_nodes) : leaves_of(tree.float_nodes);
        const std::size_t stride = grid ? shared::kBvhGridTexels : shared::kBvhFloatTexels;
        std::size_t packed_leaves = 0;
        for (std::size_t node = 1; node <= packed.node_count; ++node) {
            for (int k = 0; k < 4; ++k) {
                const std::uint32_t reference = packed.nodes[node * stride + stride / 4 * 3][k];
                if (reference == shared::kBvhNoChild || !shared::is_leaf(reference)) continue;
                ++packed_leaves;
                const auto leaf = leaves.find(reference);
                ASSERT_NE(leaf, leaves.end());
                const Bounds box = decoded(packed, node, k);
                for (int a = 0; a < 3; ++a) {
                    const float base = grid ? tree.spaces[0].base[a] : 0, cell = grid ? tree.spaces[0].cell[a] : 1;
                    EXPECT_NEAR(base + cell * leaf->second[2 * a], box.lower[a], 1e-6f);
                    EXPECT_NEAR(base + cell * leaf->second[2 * a + 1], box.upper[a], 1e-6f);
                }
            }
        }
        EXPECT_EQ(leaves.size(), packed_leaves);
        // Each node but the root is a child, as is each leaf.
        const std::size_t nodes = grid ? tree.grid_nodes.size() : tree.float_nodes.size();
        if (count > 10) {
            EXPECT_GT(leaves.size() + nodes - 1, 11 * nodes / 2);
        }
    }
}

TEST(PackedScene, UsesFloatsWhereTheGridIsTooCoarse) {
    std::vector<Ring> rings = random_rings(2000, 0.05f, 11);
    EXPECT_EQ(pack_scene(tables_of(rings)).format, NodeFormat::grid);
    // After this addition, the rings above are smaller than a grid cell of the whole scene.
    rings.push_back({vec3(0), vec3(1e6f, 0, 0), vec3(0, 1e6f, 1e6f), vec3(0)});
    EXPECT_EQ(pack_scene(tables_of(rings)).format, NodeFormat::floating);
}

TEST(PackedScene, EmptyInputGivesARootWithoutChildren) {
    const PackedScene packed = pack_scene(TraceTables{});
    EXPECT_EQ(packed.node_count, 1u);
    EXPECT_FALSE(packed.two_level);
    EXPECT_EQ(packed.nodes.back(), uvec4(shared::kBvhNoChild));
}

}  // namespace
}  // namespace halflight::rays
