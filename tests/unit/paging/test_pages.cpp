// Tests pages on the CPU: their nodes, and how hierarchies are cut.
#include "engine/paging/pages.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <numeric>
#include <random>
#include <set>

#include "engine/rays/page_node.h"
#include "shaders/shared/bvh.h"

namespace halflight::paging {
namespace {

using rays::BvhNode;
using rays::Corners;
using rays::PageNode;
using shared::kBvhIndexMask;
using shared::kBvhPageTexels;
using shared::kBvhPairTexels;

bool inside(const Bounds& inner, const Bounds& outer) {
    return glm::all(glm::greaterThanEqual(inner.lower, outer.lower)) &&
           glm::all(glm::lessThanEqual(inner.upper, outer.upper));
}

TEST(PageNode, DecodedBoxesContainTheBoxesAndAreTight) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> unit(0, 1);
    for (int run = 0; run < 20000; ++run) {
        // Extents of 10^-12 to 10^12, at distances of up to 10^7 extents; some are flat.
        const float scale = std::pow(10.0f, 24 * unit(random) - 12), distance = std::pow(10.0f, 9 * unit(random) - 2);
        const vec3 centre = scale * distance * (vec3(unit(random), unit(random), unit(random)) - 0.5f);
        const int flat = run % 4;
        BvhNode node;
        Bounds all;
        const int count = 1 + run % 4;
        for (int k = 0; k < count; ++k) {
            for (int corner = 0; corner < 2; ++corner) {
                vec3 p = vec3(unit(random), unit(random), unit(random));
                if (flat < 3) p[flat] = 0.25f;
                node.children[static_cast<std::size_t>(k)].bounds.add(centre + scale * p);
            }
            all.add(node.children[static_cast<std::size_t>(k)].bounds);
        }
        const std::uint32_t none = shared::kBvhNoChild;
        const PageNode encoded = rays::encode_page_node(node, {1u, none, none, none});
        EXPECT_EQ(encoded[3], uvec4(1u, none, none, none));
        for (int k = 0; k < 4; ++k) {
            const Bounds box = rays::decode_page_box(encoded, k);
            if (k >= count) {
                EXPECT_TRUE(box.empty());
                continue;
            }
            const Bounds& exact = node.children[static_cast<std::size_t>(k)].bounds;
            ASSERT_TRUE(inside(exact, box)) << run;
            // A side of a cell is at most 2/255 of the node's extent, or twice the step of float.
            for (int a = 0; a < 3; ++a) {
                const float most = std::max(std::abs(all.lower[a]), std::abs(all.upper[a]));
                const double cell = std::max({2.0 / 254 * all.extent()[a], double{most} * 0x1p-21, 0x1p-125});
                EXPECT_LE(double{exact.lower[a]} - box.lower[a], 2 * cell) << run;
                EXPECT_LE(double{box.upper[a]} - exact.upper[a], 2 * cell) << run;
            }
        }
    }
}

std::vector<Corners> soup(std::size_t count, float size, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> unit(0, 1);
    std::vector<Corners> triangles(count);
    for (Corners& t : triangles) {
        const vec3 at(unit(random), unit(random), unit(random));
        for (vec3& p : t) p = at + size * vec3(unit(random), unit(random), unit(random));
    }
    return triangles;
}

/// Checks the subtree of a node, and returns the bounds of its triangles.
Bounds check_subtree(const Page& page, std::uint32_t node, const std::vector<Corners>& triangles,
                     std::multiset<std::uint32_t>& met, std::set<std::uint32_t>& nodes) {
    EXPECT_LT(node, page.nodes.size() / kBvhPageTexels);
    EXPECT_TRUE(nodes.insert(node).second) << "two parents";
    PageNode texels;
    std::copy_n(page.nodes.begin() + node * kBvhPageTexels, kBvhPageTexels, texels.begin());
    Bounds all;
    for (int k = 0; k < 4; ++k) {
        const std::uint32_t reference = texels[3][k];
        if (reference == shared::kBvhNoChild) continue;
        Bounds below;
        if (shared::is_inner_node(reference)) {
            below = check_subtree(page, reference & kBvhIndexMask, triangles, met, nodes);
        } else {
            EXPECT_TRUE(shared::is_leaf(reference));
            const std::uint32_t count = (reference >> shared::kBvhCountShift) & 7u;
            EXPECT_GE(count, 1u);
            for (std::uint32_t i = 0; i < count; ++i) {
                const std::size_t pair = (reference & kBvhIndexMask) + i;
                EXPECT_LT(pair, page.pairs.size() / kBvhPairTexels);
                std::set<std::uint32_t> ids;
                for (int which = 0; which < 2; ++which)
                    ids.insert(std::bit_cast<std::uint32_t>(page.pairs[pair * kBvhPairTexels + 3][which]) &
                               shared::kBvhTriangleMask);
                for (const std::uint32_t id : ids) {
                    met.insert(id);
                    for (const vec3& p : triangles[id]) below.add(p);
                }
            }
        }
        EXPECT_TRUE(inside(below, rays::decode_page_box(texels, k)));
        all.add(below);
    }
    return all;
}

void check_pages(const std::vector<Corners>& triangles, const PageLimits& limits) {
    std::vector<std::uint32_t> ids(triangles.size());
    std::iota(ids.begin(), ids.end(), 0u);
    const PageSet set = build_pages(triangles, ids, {}, limits);
    std::multiset<std::uint32_t> met;
    std::vector<std::set<std::uint32_t>> nodes(set.pages.size());
    std::uint32_t last = 0;
    for (const PageRoot& root : set.roots) {
        ASSERT_LT(root.page, set.pages.size());
        EXPECT_GE(root.page, last);
        last = root.page;
        const Bounds below = check_subtree(set.pages[root.page], root.node, triangles, met, nodes[root.page]);
        EXPECT_EQ(below.lower, root.bounds.lower);
        EXPECT_EQ(below.upper, root.bounds.upper);
    }
    EXPECT_EQ(met, std::multiset<std::uint32_t>(ids.begin(), ids.end())) << "each triangle must occur once";
    for (std::size_t p = 0; p < set.pages.size(); ++p) {
        EXPECT_EQ(nodes[p].size(), set.pages[p].nodes.size() / kBvhPageTexels) << "nodes that nothing refers to";
        EXPECT_LE(set.pages[p].nodes.size() / kBvhPageTexels, limits.nodes);
        EXPECT_LE(set.pages[p].pairs.size() / kBvhPairTexels, limits.pairs);
    }
}

TEST(Pages, EveryTriangleIsInOnePage) {
    for (const std::size_t count : {1u, 2u, 5u, 100u, 3000u, 20000u}) check_pages(soup(count, 0.05f, 2), {64, 24});
    check_pages(soup(20000, 0.05f, 3), {});
    check_pages(soup(5000, 0.05f, 3), {4, 1});
}

TEST(Pages, CoincidentAndFlatTriangles) {
    check_pages(std::vector<Corners>(3000, soup(1, 0.5f, 4).front()), {64, 24});
    check_pages(std::vector<Corners>(500, Corners{vec3(1), vec3(1), vec3(1)}), {64, 24});
}

TEST(Pages, NoTriangles) {
    const PageSet set = build_pages({}, {});
    EXPECT_TRUE(set.pages.empty());
    EXPECT_TRUE(set.roots.empty());
}

TEST(Pages, AlphaFlagsReachTheIds) {
    const std::vector<Corners> triangles = soup(50, 0.1f, 5);
    std::vector<std::uint32_t> ids(50);
    std::iota(ids.begin(), ids.end(), 1000u);
    bool alpha[50];
    for (std::size_t i = 0; i < 50; ++i) alpha[i] = i % 3 == 0;
    const PageSet set = build_pages(triangles, ids, alpha);
    for (const Page& page : set.pages) {
        for (std::size_t pair = 0; pair < page.pairs.size() / kBvhPairTexels; ++pair) {
            for (int which = 0; which < 2; ++which) {
                const auto word = std::bit_cast<std::uint32_t>(page.pairs[pair * kBvhPairTexels + 3][which]);
                const std::uint32_t triangle = (word & shared::kBvhTriangleMask) - 1000u;
                ASSERT_LT(triangle, 50u);
                EXPECT_EQ((word & shared::kBvhAlphaTested) != 0, alpha[triangle]);
            }
        }
    }
}

}  // namespace
}  // namespace halflight::paging
