// Tests mesh repair, and tangents against MikkTSpace.
#include <gtest/gtest.h>

#include <cmath>
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

TEST(SceneTangents, OfAnUprightTexture) {
    Mesh mesh = square();
    generate_tangents(mesh, {{0, 1}, {1, 1}, {1, 0}, {0, 0}});  // v points down
    EXPECT_EQ(mesh.tangents, std::vector<vec4>(4, vec4(1, 0, 0, 1))) << "bitangent up, against v";
}

TEST(SceneTangents, OfARotatedTexture) {
    Mesh mesh = square();
    generate_tangents(mesh, {{0, 0}, {0, 1}, {1, 1}, {1, 0}});
    EXPECT_EQ(mesh.tangents, std::vector<vec4>(4, vec4(0, 1, 0, 1)));
}

TEST(SceneTangents, OfAMirroredTexture) {
    Mesh mesh = square();
    generate_tangents(mesh, {{1, 1}, {0, 1}, {0, 0}, {1, 0}});
    EXPECT_EQ(mesh.tangents, std::vector<vec4>(4, vec4(-1, 0, 0, -1)));
    EXPECT_EQ(mesh.positions.size(), 4u);
}

TEST(SceneTangents, SplitVerticesWhereTheTextureIsMirrored) {
    // Two squares lie side by side; u increases away from their seam in both.
    Mesh mesh = triangles({{-1, 0, 0}, {0, 0, 0}, {1, 0, 0}, {-1, 1, 0}, {0, 1, 0}, {1, 1, 0}},
                          {{0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}});
    mesh.normals.assign(6, {0, 0, 1});
    generate_tangents(mesh, {{1, 1}, {0, 1}, {1, 1}, {1, 0}, {0, 0}, {1, 0}});
    ASSERT_EQ(mesh.positions.size(), 8u);
    for (std::size_t t = 0; t < 4; ++t) {
        for (int corner = 0; corner < 3; ++corner) {
            const vec4 expected = t < 2 ? vec4(-1, 0, 0, -1) : vec4(1, 0, 0, 1);
            EXPECT_EQ(mesh.tangents[mesh.triangles[t][corner]], expected) << t;
        }
    }
    EXPECT_EQ(mesh.positions[6].x, 0);
    EXPECT_EQ(mesh.positions[7].x, 0);
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
    // A degenerate triangle beside a valid one takes the tangents of its neighbour.
    mesh = square();
    generate_tangents(mesh, {{0, 1}, {1, 1}, {1, 0}, {0, 1}});
    EXPECT_EQ(mesh.tangents[0], vec4(1, 0, 0, 1));
    EXPECT_EQ(mesh.tangents[2], vec4(1, 0, 0, 1));
    EXPECT_EQ(mesh.positions.size(), 4u);
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
// (one per corner) come from Blender 3.4, which uses Mikkelsen's own code.
const std::vector<vec3> kBlenderNormals{
    {-0.183050483f, 0.0603946522f, 0.98124665f},
    {-0.409790635f, 0.136103705f, 0.901968658f},
    {-0.679757178f, 0.192879841f, 0.707621038f},
    {-0.760285914f, 0.228085786f, 0.608228743f},
    {-0.0931323618f, 0.0310878716f, 0.995168269f},
    {-0.334517598f, 0.114219844f, 0.93544203f},
    {-0.636604607f, 0.183858097f, 0.748953104f},
    {-0.741505921f, 0.220530167f, 0.633668244f},
    {0, 0, 1},
    {-0.254876226f, 0.0879202783f, 0.962968409f},
    {-0.586796045f, 0.170298025f, 0.791624308f},
    {-0.715020597f, 0.216458932f, 0.664748788f},
};
const std::vector<vec4> kBlenderTangents{
    {-0.981854558f, -0.0615255982f, -0.179377034f, 1}, {-0.911842823f, -0.0342545919f, -0.409107894f, 1},
    {-0.938212872f, -0.133715734f, -0.319181383f, 1},  {-0.981854558f, -0.0615255982f, -0.179377034f, 1},
    {-0.938212872f, -0.133715734f, -0.319181383f, 1},  {-0.98364085f, -0.15766868f, -0.0871281922f, 1},
    {-0.911842823f, -0.0342545919f, -0.409107894f, 1}, {-0.724116087f, -0.0231629033f, -0.689288974f, 1},
    {-0.770678043f, -0.116274737f, -0.626526594f, 1},  {-0.911842823f, -0.0342545919f, -0.409107894f, 1},
    {-0.770678043f, -0.116274737f, -0.626526594f, 1},  {-0.938212872f, -0.133715734f, -0.319181383f, 1},
    {0.727142155f, 0.0510934815f, 0.68458277f, -1},    {0.624695063f, 0, 0.780868828f, -1},
    {0.661261261f, 0.0803128108f, 0.745844126f, -1},   {0.727142155f, 0.0510934815f, 0.68458277f, -1},
    {0.661261261f, 0.0803128108f, 0.745844126f, -1},   {0.771132469f, 0.13985613f, 0.62112397f, -1},
    {-0.98364085f, -0.15766868f, -0.0871281922f, 1},   {-0.938212872f, -0.133715734f, -0.319181383f, 1},
    {-0.94680512f, -0.225024015f, -0.230053201f, 1},   {-0.98364085f, -0.15766868f, -0.0871281922f, 1},
    {-0.94680512f, -0.225024015f, -0.230053201f, 1},   {-0.970142424f, -0.242535606f, 0, 1},
    {-0.938212872f, -0.133715734f, -0.319181383f, 1},  {-0.770678043f, -0.116274737f, -0.626526594f, 1},
    {-0.806310833f, -0.21269834f, -0.551925957f, 1},   {-0.938212872f, -0.133715734f, -0.319181383f, 1},
    {-0.806310833f, -0.21269834f, -0.551925957f, 1},   {-0.94680512f, -0.225024015f, -0.230053201f, 1},
    {0.771132469f, 0.13985613f, 0.62112397f, -1},      {0.661261261f, 0.0803128108f, 0.745844126f, -1},
    {0.698276341f, 0.174888641f, 0.694135487f, -1},    {0.771132469f, 0.13985613f, 0.62112397f, -1},
    {0.698276341f, 0.174888641f, 0.694135487f, -1},    {0.805977583f, 0.216908857f, 0.550773025f, -1},
};

TEST(SceneTangents, AgreeWithBlender) {
    Mesh mesh;
    std::vector<vec2> uv;
    for (int i = 0; i < 12; ++i) {
        const auto x = static_cast<float>(i % 4), y = static_cast<float>(i / 4);
        mesh.positions.emplace_back(x, y, 0.25f * x * x - 0.125f * x * y);
        uv.emplace_back(std::abs(x - 2) * 0.25f + 0.125f * y, 0.5f * y - 0.0625f * x * y);
    }
    for (std::uint32_t y = 0; y < 2; ++y) {
        for (std::uint32_t x = 0; x < 3; ++x) {
            const std::uint32_t a = 4 * y + x, b = a + 1, c = b + 4, d = a + 4;
            mesh.triangles.emplace_back(a, b, c);
            mesh.triangles.emplace_back(a, c, d);
        }
    }
    mesh.triangle_material.assign(12, 0);
    mesh.normals = kBlenderNormals;
    generate_tangents(mesh, uv);
    EXPECT_EQ(mesh.positions.size(), 15u) << "the three vertices on the seam are split";
    for (std::size_t corner = 0; corner < 36; ++corner) {
        const vec4 tangent = mesh.tangents[mesh.triangles[corner / 3][static_cast<int>(corner % 3)]];
        EXPECT_LT(glm::distance(tangent, kBlenderTangents[corner]), 1e-5f) << corner;
    }
}

}  // namespace
}  // namespace halflight
