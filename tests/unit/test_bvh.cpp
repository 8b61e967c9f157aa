// Hierarchies before they reach the GPU.
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <bit>
#include <functional>
#include <numeric>
#include <random>
#include <set>

#include "engine/rays/packed_bvh.h"
#include "shaders/shared/bvh.h"

namespace halflight::rays {
namespace {

std::vector<Corners> random_triangles(std::size_t count, float size, std::uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> uniform(-1, 1);
    const auto point = [&] { return vec3(uniform(random), uniform(random), uniform(random)); };
    std::vector<Corners> triangles(count);
    for (Corners& t : triangles) {
        const vec3 centre = point();
        for (vec3& p : t) p = centre + size * point();
    }
    return triangles;
}

Bounds box_of(const Corners& triangle) {
    Bounds box;
    for (const vec3& p : triangle) box.add(p);
    return box;
}

bool inside(const Bounds& inner, const Bounds& outer) {
    return glm::all(glm::greaterThanEqual(inner.lower, outer.lower)) &&
           glm::all(glm::lessThanEqual(inner.upper, outer.upper));
}

/// Calls f(child, depth in put-aside children) for all children below a node, checks that boxes nest.
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

void check_triangles(const std::vector<Corners>& triangles) {
    const Bvh bvh = build_triangle_bvh(triangles);
    Bounds all;
    for (const Corners& t : triangles) all.add(box_of(t));
    std::vector<std::vector<Bounds>> parts(triangles.size());
    std::size_t entries = 0;
    const std::uint32_t stack = walk(bvh, 0, all, [&](const BvhChild& child) {
        if (!child.leaf()) return;
        EXPECT_LE(child.count, kMaxLeafPrimitives);
        entries += child.count;
        for (std::uint32_t i = child.first; i < child.first + child.count; ++i) {
            parts[bvh.primitives[i]].push_back(child.bounds);
        }
    });
    EXPECT_EQ(stack, bvh.stack_entries);
    EXPECT_EQ(entries, bvh.primitives.size());
    EXPECT_LE(entries, static_cast<std::size_t>(kSplitBudget * static_cast<double>(triangles.size())) + 1);

    // Each point of a triangle lies in one of the leaves that name it.
    std::mt19937 random(7);
    std::uniform_real_distribution<double> uniform(0, 1);
    std::size_t outside = 0;
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        for (int sample = 0; sample < 20; ++sample) {
            const double r = std::sqrt(uniform(random)), u = r * uniform(random);
            const auto& [a, b, c] = triangles[i];
            const dvec3 p = (1 - r) * dvec3(a) + u * dvec3(b) + (r - u) * dvec3(c);
            outside += std::none_of(parts[i].begin(), parts[i].end(), [&](const Bounds& box) {
                return glm::all(glm::greaterThanEqual(p, dvec3(box.lower) - 1e-15)) &&
                       glm::all(glm::lessThanEqual(p, dvec3(box.upper) + 1e-15));
            });
        }
    }
    EXPECT_EQ(outside, 0u);
}

TEST(Bvh, HoldsEveryTriangle) {
    check_triangles(random_triangles(3000, 0.02f, 1));
    check_triangles(random_triangles(3000, 0.7f, 2));  // many splits
    check_triangles(random_triangles(1, 1, 3));
    check_triangles(random_triangles(4, 1, 4));
    check_triangles(random_triangles(5, 1, 5));
}

TEST(Bvh, HoldsCoincidentAndFlatTriangles) {
    check_triangles(std::vector<Corners>(5000, Corners{vec3(0), vec3(1, 0, 0), vec3(0, 1, 0)}));
    check_triangles(std::vector<Corners>(5000, Corners{vec3(0.5f), vec3(0.5f), vec3(0.5f)}));
    std::vector<Corners> flat = random_triangles(3000, 0.3f, 6);
    for (Corners& t : flat) {
        for (vec3& p : t) p.y = 0.25f;
    }
    check_triangles(flat);
}

TEST(Bvh, OfBoxesHasOneInALeaf) {
    std::vector<Bounds> boxes;
    for (const Corners& t : random_triangles(500, 0.3f, 8)) boxes.push_back(box_of(t));
    const Bvh bvh = build_bvh(boxes);
    std::set<std::uint32_t> seen;
    walk(bvh, 0, {vec3(-10), vec3(10)}, [&](const BvhChild& child) {
        if (!child.leaf()) return;
        EXPECT_EQ(child.count, 1u);
        EXPECT_TRUE(inside(boxes[bvh.primitives[child.first]], child.bounds));
        EXPECT_TRUE(seen.insert(bvh.primitives[child.first]).second);
    });
    EXPECT_EQ(seen.size(), boxes.size());
}

TEST(Bvh, OfNothingIsEmpty) {
    EXPECT_TRUE(build_bvh({}).nodes.empty());
    EXPECT_TRUE(build_triangle_bvh({}).nodes.empty());
}

bool same(const Bvh& a, const Bvh& b) {
    if (a.primitives != b.primitives || a.nodes.size() != b.nodes.size()) return false;
    for (std::size_t i = 0; i < a.nodes.size(); ++i) {
        for (std::size_t k = 0; k < 4; ++k) {
            const BvhChild &x = a.nodes[i].children[k], &y = b.nodes[i].children[k];
            if (x.bounds.lower != y.bounds.lower || x.bounds.upper != y.bounds.upper || x.first != y.first ||
                x.count != y.count) {
                return false;
            }
        }
    }
    return true;
}

TEST(Bvh, IsTheSameWithAnyNumberOfThreads) {
    const std::vector<Corners> triangles = random_triangles(20000, 0.1f, 9);
    const Bvh reference = build_triangle_bvh(triangles);
    for (const int threads : {1, 2}) {
        tbb::task_arena arena(threads);
        for (int repeat = 0; repeat < 2; ++repeat) {
            arena.execute([&] { EXPECT_TRUE(same(reference, build_triangle_bvh(triangles))) << threads; });
        }
    }
}

TraceTables tables_of(const std::vector<Corners>& triangles) {
    TraceTables tables;
    Block block;
    for (const Corners& t : triangles) {
        const auto first = static_cast<std::uint32_t>(tables.positions.size());
        tables.positions.insert(tables.positions.end(), t.begin(), t.end());
        tables.triangles.emplace_back(first, first + 1, first + 2, 0);
        block.bounds.add(box_of(t));
    }
    block.triangle_count = static_cast<std::uint32_t>(triangles.size());
    tables.bounds = block.bounds;
    tables.blocks = {block};
    tables.instances.emplace_back().identity = true;
    return tables;
}

/// Bounds of child k of a node in a packed scene, as kernels see them.
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

class Packed : public ::testing::TestWithParam<NodeFormat> {};

TEST_P(Packed, BoxesContainWhatTheyHold) {
    for (const float size : {0.01f, 0.5f}) {
        const TraceTables tables = tables_of(random_triangles(2000, size, 10));
        const PackedScene packed = pack_scene(tables, GetParam());
        const std::size_t stride = GetParam() == NodeFormat::grid ? shared::kBvhGridTexels : shared::kBvhFloatTexels;
        std::vector<Bounds> seen(tables.triangles.size());
        std::vector<std::size_t> open{1};
        std::vector<Bounds> around{tables.bounds};
        std::size_t nodes = 0;
        const float rounding = 1e-6f;  // of decoded() in float
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
                for (std::uint32_t slot = first; slot < first + count; ++slot) {
                    const auto id =
                        std::bit_cast<std::uint32_t>(packed.triangles[3 * slot].w) & shared::kBvhTriangleMask;
                    ASSERT_LT(id, tables.triangles.size());
                    seen[id].add(box);
                    for (int a = 0; a < 3; ++a) {
                        for (int c = 0; c < 3; ++c) {
                            EXPECT_EQ(packed.triangles[3 * slot + a][c], tables.positions[tables.triangles[id][c]][a]);
                        }
                    }
                }
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

TEST(PackedScene, TakesFloatsWhereAGridIsTooCoarse) {
    std::vector<Corners> triangles = random_triangles(2000, 0.05f, 11);
    EXPECT_EQ(pack_scene(tables_of(triangles)).format, NodeFormat::grid);
    // All of it is now less than a cell of the grid over the whole.
    triangles.push_back({vec3(0), vec3(1e6f, 0, 0), vec3(0, 1e6f, 1e6f)});
    EXPECT_EQ(pack_scene(tables_of(triangles)).format, NodeFormat::floating);
}

TEST(PackedScene, OfNothingHasARootWithoutChildren) {
    const PackedScene packed = pack_scene(TraceTables{});
    EXPECT_EQ(packed.node_count, 1u);
    EXPECT_FALSE(packed.two_level);
    EXPECT_EQ(packed.nodes.back(), uvec4(shared::kBvhNoChild));
}

}  // namespace
}  // namespace halflight::rays
