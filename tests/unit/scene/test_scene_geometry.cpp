// Tests mesh repair, and tangents against MikkTSpace.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/type_ptr.hpp>
#include <limits>

#include "engine/scene/geometry.h"
#include "engine/scene/tangents.h"

namespace halflight {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

Mesh triangles(std::vector<vec3> positions, std::vector<uvec3> indices) {
    Mesh mesh;
    mesh.positions = std::move(positions);
    mesh.triangles = std::move(indices);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
        mesh.triangle_material.push_back(static_cast<std::uint32_t>(i));
    return mesh;
}

TEST(SceneGeometry, DropsDegenerateTrianglesAndUnusedVertices) {
    Mesh mesh = triangles({{kNan, 0, 0}, {0, 0, 0}, {1, 0, 0}, {9, 9, 9}, {0, 1, 0}, {2, 0, 0}, {0, kInfinity, 0}},
                          {{0, 1, 2}, {1, 2, 5}, {1, 2, 4}, {1, 1, 4}, {1, 6, 2}});
    mesh.uvs[1] = {{0, 0}, {1, 0}, {2, 0}, {3, 0}, {4, 0}, {5, 0}, {6, 0}};
    const DroppedTriangles dropped = drop_bad_triangles(mesh);
    EXPECT_EQ(dropped.non_finite, 2u);
    EXPECT_EQ(dropped.degenerate, 2u);
    EXPECT_EQ(mesh.triangles, (std::vector<uvec3>{{0, 1, 2}}));
    EXPECT_EQ(mesh.triangle_material, (std::vector<std::uint32_t>{2}));
    EXPECT_EQ(mesh.positions, (std::vector<vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
    EXPECT_EQ(mesh.uvs[1], (std::vector<vec2>{{1, 0}, {2, 0}, {4, 0}}));
}

TEST(SceneGeometry, KeepsTheSmallestTriangle) {
    const float tiny = std::numeric_limits<float>::denorm_min();
    Mesh mesh = triangles({{0, 0, 0}, {tiny, 0, 0}, {0, tiny, 0}}, {{0, 1, 2}});
    EXPECT_EQ(drop_bad_triangles(mesh).degenerate, 0u);
    generate_flat_normals(mesh);
    EXPECT_EQ(mesh.normals[2], vec3(0, 0, 1));
}

TEST(SceneGeometry, FlatNormalsUnshareVertices) {
    Mesh mesh = triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 1, 2}, {0, 2, 3}});
    mesh.uvs[0] = {{0, 0}, {1, 0}, {2, 0}, {3, 0}};
    EXPECT_EQ(generate_flat_normals(mesh), 6u);
    EXPECT_EQ(mesh.triangles, (std::vector<uvec3>{{0, 1, 2}, {3, 4, 5}}));
    EXPECT_EQ(mesh.normals[1], vec3(0, 0, 1));
    EXPECT_EQ(mesh.normals[4], vec3(1, 0, 0));
    EXPECT_EQ(mesh.uvs[0], (std::vector<vec2>{{0, 0}, {1, 0}, {2, 0}, {0, 0}, {2, 0}, {3, 0}}));
}

TEST(SceneGeometry, RepairsNormals) {
    Mesh mesh = triangles({{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 0, 2}}, {{0, 1, 2}, {0, 2, 3}});
    mesh.normals = {{0, 0, 0}, {0, 1e-30f, 0}, {kNan, 0, 0}, {3e38f, 0, 3e38f}};
    EXPECT_EQ(repair_normals(mesh), 2u);
    const float half = std::sqrt(0.5f);
    const vec3 expected[] = {{half, 0, half}, {0, 1, 0}, {half, 0, half}, {half, 0, half}};
    for (std::size_t i = 0; i < 4; ++i) EXPECT_LT(glm::distance(mesh.normals[i], expected[i]), 1e-6f) << i;
}

TEST(SceneGeometry, RepairsNormalsOfASheetWithTwoSides) {
    Mesh mesh = triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 1}});
    mesh.normals.assign(3, vec3(0));
    EXPECT_EQ(repair_normals(mesh), 3u);
    EXPECT_EQ(glm::abs(mesh.normals[0]), vec3(0, 0, 1));
}

TEST(SceneGeometry, AppendFillsMissingAttributes) {
    Mesh first = triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
    first.normals.assign(3, {0, 0, 1});
    first.uvs[0].assign(3, vec2(0.5f));
    Mesh second = first;
    second.uvs[0].clear();
    second.colors.assign(3, vec4(0.25f));
    second.tangents.assign(3, vec4(0, 1, 0, -1));
    append(first, second);
    append(first, triangles({}, {}));
    EXPECT_EQ(first.triangles[1], uvec3(3, 4, 5));
    EXPECT_EQ(first.uvs[0][2], vec2(0.5f));
    EXPECT_EQ(first.uvs[0][5], vec2(0));
    EXPECT_TRUE(first.uvs[1].empty());
    EXPECT_EQ(first.colors[0], vec4(1));
    EXPECT_EQ(first.colors[3], vec4(0.25f));
    EXPECT_EQ(first.tangents[4], vec4(0, 1, 0, -1));
    EXPECT_EQ(glm::length(vec3(first.tangents[0])), 1.0f);
    EXPECT_EQ(glm::dot(vec3(first.tangents[0]), first.normals[0]), 0.0f);
}

/// Returns a unit square in the plane z = 0, facing +Z.
Mesh square() {
    Mesh mesh = triangles({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}});
    mesh.normals.assign(4, {0, 0, 1});
    return mesh;
}

TEST(SceneTangents, FollowTheTexture) {
    const std::pair<std::vector<vec2>, vec4> cases[] = {
        {{{0, 1}, {1, 1}, {1, 0}, {0, 0}}, {1, 0, 0, 1}},    // upright: v points down; the bitangent points up
        {{{0, 0}, {0, 1}, {1, 1}, {1, 0}}, {0, 1, 0, 1}},    // rotated
        {{{1, 1}, {0, 1}, {0, 0}, {1, 0}}, {-1, 0, 0, -1}},  // mirrored
        {{{0, 1}, {1, 1}, {1, 0}, {0, 1}}, {1, 0, 0, 1}}};   // the degenerate triangle takes those of its neighbour
    for (const auto& [uv, tangent] : cases) {
        Mesh mesh = square();
        generate_tangents(mesh, uv);
        EXPECT_EQ(mesh.tangents[0], tangent);
        EXPECT_EQ(mesh.tangents[2], tangent);
        EXPECT_EQ(mesh.tangents.size(), 4u);
    }
}

TEST(SceneTangents, AgreeWithoutSharedVertices) {
    Mesh shared = square();
    shared.positions[2].z = 0.5f;
    shared.normals.assign(4, glm::normalize(vec3(-0.3f, -0.2f, 1)));
    const std::vector<vec2> uv{{0, 1}, {0.9f, 1}, {1, 0}, {0, 0.1f}};
    Mesh unshared = shared;
    const std::vector<std::uint32_t> corners{0, 1, 2, 0, 2, 3};
    gather_vertices(unshared, corners);
    unshared.triangles = {{0, 1, 2}, {3, 4, 5}};
    std::vector<vec2> unshared_uv;
    for (const std::uint32_t c : corners) unshared_uv.push_back(uv[c]);
    generate_tangents(shared, uv);
    generate_tangents(unshared, unshared_uv);
    for (std::size_t i = 0; i < corners.size(); ++i) EXPECT_EQ(unshared.tangents[i], shared.tangents[corners[i]]) << i;
}

TEST(SceneTangents, AreUnitWhereTheTextureHasNoArea) {
    Mesh mesh = square();
    generate_tangents(mesh, std::vector<vec2>(4, vec2(0.5f)));
    for (const vec4& t : mesh.tangents) {
        EXPECT_EQ(glm::length(vec3(t)), 1.0f);
        EXPECT_EQ(t.z, 0.0f);
        EXPECT_EQ(std::abs(t.w), 1.0f);
    }
}

TEST(SceneTangents, OfAFanTooLargeForRecursion) {
    constexpr std::uint32_t kCount = 200000;
    Mesh mesh;
    std::vector<vec2> uv;
    mesh.positions.push_back(vec3(0));
    uv.push_back(vec2(0));
    for (std::uint32_t i = 0; i <= kCount; ++i) {
        const double angle = 3.0 * i / kCount;
        mesh.positions.emplace_back(std::cos(angle), std::sin(angle), 0);
        uv.emplace_back(std::cos(angle), -std::sin(angle));
        if (i > 0) mesh.triangles.emplace_back(0, i, i + 1);
    }
    mesh.normals.assign(mesh.positions.size(), {0, 0, 1});
    mesh.triangle_material.assign(kCount, 0);
    generate_tangents(mesh, uv);
    EXPECT_EQ(mesh.positions.size(), kCount + 2u);
    EXPECT_LT(glm::distance(mesh.tangents[0], vec4(1, 0, 0, 1)), 1e-3f);
}

// The strip has 3 x 2 quads, is bent, and mirrors its texture at the third column of vertices. Normals and tangents
// come from Blender 3.4, which uses Mikkelsen's own code. Tangents are those of the vertices of the first two columns
// of quads, then of the last column.
constexpr float kBlenderNormals[] = {
    -0.1830505f, 0.06039465f, 0.9812466f, -0.4097906f,  0.1361037f,  0.9019687f, -0.6797572f, 0.1928798f, 0.707621f,
    -0.7602859f, 0.2280858f,  0.6082287f, -0.09313236f, 0.03108787f, 0.9951683f, -0.3345176f, 0.1142198f, 0.935442f,
    -0.6366046f, 0.1838581f,  0.7489531f, -0.7415059f,  0.2205302f,  0.6336682f, 0,           0,          1,
    -0.2548762f, 0.08792028f, 0.9629684f, -0.586796f,   0.170298f,   0.7916243f, -0.7150206f, 0.2164589f, 0.6647488f};
constexpr float kBlenderTangents[] = {
    -0.9818546f, -0.0615256f, -0.179377f,  1,  -0.9118428f, -0.03425459f, -0.4091079f,  1,
    -0.7241161f, -0.0231629f, -0.689289f,  1,  -0.9836409f, -0.1576687f,  -0.08712819f, 1,
    -0.9382129f, -0.1337157f, -0.3191814f, 1,  -0.770678f,  -0.1162747f,  -0.6265266f,  1,
    -0.9701424f, -0.2425356f, 0,           1,  -0.9468051f, -0.225024f,   -0.2300532f,  1,
    -0.8063108f, -0.2126983f, -0.551926f,  1,  0.7271422f,  0.05109348f,  0.6845828f,   -1,
    0.6246951f,  0,           0.7808688f,  -1, 0.7711325f,  0.1398561f,   0.621124f,    -1,
    0.6612613f,  0.08031281f, 0.7458441f,  -1, 0.8059776f,  0.2169089f,   0.550773f,    -1,
    0.6982763f,  0.1748886f,  0.6941355f,  -1};

TEST(SceneTangents, AgreeWithBlender) {
    Mesh mesh;
    std::vector<vec2> uv;
    for (int i = 0; i < 12; ++i) {
        const auto x = static_cast<float>(i % 4), y = static_cast<float>(i / 4);
        mesh.positions.emplace_back(x, y, 0.25f * x * x - 0.125f * x * y);
        uv.emplace_back(std::abs(x - 2) * 0.25f + 0.125f * y, 0.5f * y - 0.0625f * x * y);
    }
    for (std::uint32_t y = 0; y < 2; ++y)
        for (std::uint32_t x = 0; x < 3; ++x) {
            const std::uint32_t a = 4 * y + x, b = a + 1, c = b + 4, d = a + 4;
            mesh.triangles.emplace_back(a, b, c);
            mesh.triangles.emplace_back(a, c, d);
        }
    mesh.triangle_material.assign(12, 0);
    for (int i = 0; i < 12; ++i) mesh.normals.push_back(glm::make_vec3(kBlenderNormals + 3 * i));
    const std::vector<uvec3> unsplit = mesh.triangles;
    generate_tangents(mesh, uv);
    EXPECT_EQ(mesh.positions.size(), 15u) << "the three vertices on the seam are split";
    for (std::uint32_t corner = 0; corner < 36; ++corner) {
        const int k = static_cast<int>(corner % 3);
        const std::uint32_t at = unsplit[corner / 3][k], x = at % 4, y = at / 4;
        const float* expected = kBlenderTangents + 4 * (corner / 6 % 3 < 2 ? 3 * y + x : 9 + 2 * y + x - 2);
        const vec4& tangent = mesh.tangents[mesh.triangles[corner / 3][k]];
        EXPECT_LT(glm::distance(tangent, glm::make_vec4(expected)), 1e-5f) << corner;
    }
}

}  // namespace
}  // namespace halflight
