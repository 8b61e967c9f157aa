// Tests the merging of triangles into pairs.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "engine/rays/pairs.h"

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
    for (int y = 0; y < n; ++y) {
        for (int x = 0; x < n; ++x) {
            const vec3 a(x, y, 0), b(x + 1, y, 0), c(x + 1, y + 1, 0), d(x, y + 1, 0);
            triangles.push_back({a, b, c});
            triangles.push_back({a, c, d});
        }
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

}  // namespace
}  // namespace halflight::rays
