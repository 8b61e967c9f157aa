// Tests the contract of the plain tracer for single rays: ties, ends, degenerate directions, closed meshes without
// leaks. Results depend neither on order nor on the kernel.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numeric>
#include <random>

#include "engine/gpu/framebuffer.h"
#include "shaders/shared/bvh_nodes.h"
#include "tests/pass/rays/tracer_harness.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

using namespace test;
using rays::NodeFormat;

constexpr NodeFormat kFormats[] = {NodeFormat::grid, NodeFormat::floating};

class TracerRules : public GpuTest {};

/// Adds two triangles over [-1, 1]^2 at height z.
void add_square(std::vector<vec3>& positions, std::vector<uvec3>& triangles, float z) {
    const auto first = static_cast<unsigned>(positions.size());
    for (const vec2& p : {vec2(-1, -1), vec2(1, -1), vec2(1, 1), vec2(-1, 1)}) positions.emplace_back(p, z);
    triangles.emplace_back(first, first + 1, first + 2);
    triangles.emplace_back(first, first + 2, first + 3);
}

Scene squares(const std::vector<float>& heights) {
    std::vector<vec3> positions;
    std::vector<uvec3> triangles;
    for (const float z : heights) add_square(positions, triangles, z);
    return of_one_mesh(positions, triangles);
}

/// A ray and its expected hit. If t is infinite, no hit is expected.
struct Expected {
    Ray ray;
    float t = kInfinity;
    std::uint32_t triangle = kMiss;
};
/// Expects closest and any hits of single rays, with both formats of nodes.
void expect_hits(const TraceTables& tables, const std::vector<Expected>& rows) {
    std::vector<Ray> rays;
    for (const Expected& row : rows) rays.push_back(row.ray);
    for (const NodeFormat format : kFormats) {
        Tracer tracer(tables, format);
        const std::vector<Hit> hits = tracer.closest(rays);
        const std::vector<std::uint32_t> occluded = tracer.any(rays);
        for (std::size_t i = 0; i < rows.size(); ++i) {
            EXPECT_EQ(hits[i].t, rows[i].t) << i;
            EXPECT_EQ(hits[i].triangle == kMiss, rows[i].t == kInfinity) << i;
            if (rows[i].triangle != kMiss) {
                EXPECT_EQ(hits[i].triangle, rows[i].triangle) << i;
            }
            EXPECT_EQ(occluded[i], rows[i].t == kInfinity ? 0u : 1u) << i;
        }
    }
}

TEST_F(TracerRules, BarycentricsAreWeightsOfTheSecondAndThirdCorner) {
    const TraceTables tables = build_trace_tables(of_one_mesh({{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, {{0, 1, 2}}));
    const vec3 origin(tables.origin);
    for (const float side : {1.0f, -1.0f}) {
        const std::vector<Ray> rays{{vec3(1, 2, 3 * side) - origin, 0, vec3(0, 0, -2 * side), kInfinity}};
        const Hit hit = Tracer(tables).closest(rays)[0];
        EXPECT_EQ(hit.triangle, 0u);
        EXPECT_EQ(hit.instance, 0u);
        EXPECT_EQ(hit.t, 1.5f);
        EXPECT_EQ(hit.u, 0.25f);
        EXPECT_EQ(hit.v, 0.5f);
    }
}

TEST_F(TracerRules, PairsKeepTheOrderOfEachTrianglesCorners) {
    const std::vector<vec3> positions{{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}};
    uvec3 first(0, 1, 2), second(0, 2, 3);
    int others = 0;
    for (int i = 0; i < 36; ++i) {
        // All six orders of the first triangle's corners are combined with all orders of the second one's.
        first = i % 2 ? uvec3(first.y, first.x, first.z) : uvec3(first.x, first.z, first.y);
        if (i % 6 == 5) second = i % 4 == 1 ? uvec3(second.y, second.x, second.z) : uvec3(second.x, second.z, second.y);
        const TraceTables tables = build_trace_tables(of_one_mesh(positions, {first, second}));
        ASSERT_EQ(rays::pack_scene(tables).pairs.size(), std::size_t{shared::kBvhPairTexels});
        for (const vec2& at : {vec2(3, 0.5f), vec2(1, 2.5f)}) {
            const std::vector<Ray> rays{{vec3(at, 1) - vec3(tables.origin), 0, vec3(0, 0, -1), kInfinity}};
            const Hit hit = Tracer(tables).closest(rays)[0];
            ASSERT_LT(hit.triangle, 2u);
            others += hit.triangle == 1;
            const uvec3 corners = hit.triangle == 0 ? first : second;
            const vec3 met = (1 - hit.u - hit.v) * positions[corners.x] + hit.u * positions[corners.y] +
                             hit.v * positions[corners.z];
            EXPECT_EQ(met, vec3(at, 0)) << i;
        }
    }
    EXPECT_EQ(others, 36);
}

TEST_F(TracerRules, RaysMeetBothTrianglesOfABentPair) {
    const TraceTables tables =
        build_trace_tables(of_one_mesh({{0, 0, 0}, {0, 4, 0}, {4, 2, 1}, {4, 2, -1}}, {{0, 1, 2}, {1, 0, 3}}));
    ASSERT_EQ(rays::pack_scene(tables).pairs.size(), std::size_t{shared::kBvhPairTexels});
    const vec3 above = vec3(2, 2, 2) - vec3(tables.origin), below = vec3(2, 2, -2) - vec3(tables.origin);
    const vec3 up(0, 0, 1), down(0, 0, -1);
    expect_hits(tables, {{{above, 0, down, kInfinity}, 1.5f, 0},
                         {{below, 0, up, kInfinity}, 1.5f, 1},
                         {{above, 2, down, kInfinity}, 2.5f, 1},
                         {{below, 2, up, kInfinity}, 2.5f, 0},
                         {{above, 0, down, 1}},
                         {{above, 2, down, 2.25f}}});
}

TEST_F(TracerRules, BothEndsOfTheRayAreOpen) {
    const TraceTables tables = build_trace_tables(squares({-1, 0, 1}));
    const vec3 down(0, 0, -1), above(0.25f, 0.5f, 2);
    expect_hits(tables, {{{above, 0, down, kInfinity}, 1},
                         {{above, 1, down, kInfinity}, 2},
                         {{above, std::nextafter(1.0f, 0.0f), down, kInfinity}, 1},
                         {{above, 0, down, 1}},
                         {{above, 0, down, std::nextafter(1.0f, 2.0f)}, 1},
                         {{above, 3, down, kInfinity}},
                         {{above, 1, down, 2}},
                         {{above, 2, down, 1}},
                         {{above, 0, down, 0}},
                         {{above, 0, down, -1}},
                         {{above, 0, -down, kInfinity}},
                         {{above, 1, down, 1}}});
    expect_hits(TraceTables{}, {{{above, 0, down, kInfinity}}});
}

TEST_F(TracerRules, LowestTriangleWinsTies) {
    // The leaves split twelve copies of one square arbitrarily.
    const TraceTables tables = build_trace_tables(squares(std::vector<float>(12, 0.0f)));
    std::vector<Ray> rays;
    for (int i = 0; i < 200; ++i) {
        const float x = 0.009f * static_cast<float>(i) - 0.9f, y = 0.4f * std::sin(static_cast<float>(i));
        rays.push_back({vec3(x, y, 1), 0, vec3(0.1f, 0.05f, -1), kInfinity});
    }
    for (const NodeFormat format : kFormats) {
        for (const Hit& hit : Tracer(tables, format).closest(rays)) EXPECT_LE(hit.triangle, 1u);
    }
}

TEST_F(TracerRules, LowestInstanceWinsTies) {
    Scene scene = squares({0});
    scene.instances.clear();
    for (int i = 0; i < 9; ++i) add_instance(scene, 0, glm::translate(dmat4(1), dvec3(0, 0, i % 3 ? 0 : -1)));
    const TraceTables tables = build_trace_tables(scene);
    const std::vector<Ray> rays{{vec3(0.3f, 0.1f, 2) - vec3(tables.origin), 0, vec3(0, 0, -1), kInfinity}};
    EXPECT_EQ(Tracer(tables).closest(rays)[0].instance, 1u);
}

TEST_F(TracerRules, AxisAlignedRaysAlongEdgesAndFaces) {
    // A lattice has its vertices at integers. Rays parallel to the axes through its vertices and edges must not pass
    // through it.
    std::vector<vec3> positions;
    std::vector<uvec3> triangles;
    for (unsigned a = 0; a < 81; ++a) {
        positions.emplace_back(int(a % 9) - 4, int(a / 9) - 4, 0);
        if (a % 9 == 8 || a / 9 == 8) continue;
        triangles.emplace_back(a, a + 1, a + 10);
        triangles.emplace_back(a, a + 10, a + 9);
    }
    const TraceTables tables = build_trace_tables(of_one_mesh(positions, triangles));
    std::vector<Ray> across, along;
    for (int j = -7; j <= 7; ++j) {
        for (int i = -7; i <= 7; ++i) {
            const vec3 p(0.5f * static_cast<float>(i), 0.5f * static_cast<float>(j), 3);
            across.push_back({p, 0, vec3(0, 0, -1), kInfinity});
            across.push_back({p - vec3(0, 0, 6), 0, vec3(-0.0f, 0.0f, 0.5f), 7});
            across.push_back({p, 0, vec3(1e-30f, -1e-30f, -1), kInfinity});
            along.push_back({vec3(-9, p.y, 0), 0, vec3(1, 0, 0), kInfinity});     // rays in the plane
            along.push_back({vec3(-9, p.y, 0.5f), 0, vec3(1, 0, 0), kInfinity});  // rays beside the plane
        }
    }
    for (const NodeFormat format : kFormats) {
        Tracer tracer(tables, format);
        for (const Hit& hit : tracer.closest(across)) EXPECT_NE(hit.triangle, kMiss);
        for (const Hit& hit : tracer.closest(along)) EXPECT_EQ(hit.triangle, kMiss);
    }
}

/// Expects all rays from inside the first instance, a closed mesh, to hit it. They are aimed at vertices, edges and
/// faces.
void expect_no_leak(const Scene& scene, std::size_t count, std::uint32_t seed) {
    const TraceTables tables = build_trace_tables(scene);
    const glm::mat4x3& to_world = tables.instances[0].block_to_world;
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> uniform(0, 1);
    std::vector<Ray> rays;
    while (rays.size() < count) {
        const uvec4 t = tables.triangles[random() % tables.triangles.size()];
        const auto corner = [&](std::uint32_t i) { return to_world * vec4(tables.positions[i], 1); };
        const vec3 a = corner(t.x), b = corner(t.y), c = corner(t.z);
        const float s = uniform(random);
        vec3 target = rays.size() % 4 == 0 ? a : (rays.size() % 4 == 3 ? (a + b + c) / 3.0f : glm::mix(a, b, s));
        const vec3 inside =
            0.3f * (vec3(uniform(random), uniform(random), uniform(random)) - 0.5f) * tables.bounds.extent();
        if (rays.size() % 8 < 4) target = glm::mix(target, inside, 0.5f);  // the ray hits the vertex with rounding
        rays.push_back({inside, 0, target - inside, kInfinity});
    }
    for (const NodeFormat format : kFormats) {
        std::size_t leaks = 0;
        for (const Hit& hit : Tracer(tables, format).closest(rays)) leaks += hit.triangle == kMiss || hit.instance != 0;
        EXPECT_EQ(leaks, 0u);
    }
}

TEST_F(TracerRules, ClosedMeshesDoNotLeak) {
    expect_no_leak(sphere(64, vec3(0), 1), 200000, 1);
    expect_no_leak(sphere(150, vec3(0), 1), 200000, 2);  // the sphere has slivers at its poles
    Scene flat = sphere(48, vec3(0), 1);
    flat.instances[0].object_to_world = glm::scale(dmat4(1), dvec3(1, 1e-3, 30));
    expect_no_leak(flat, 100000, 3);
    Scene twice = sphere(48, vec3(7, 8, 9), 1);
    const dmat4 m = glm::rotate(glm::scale(dmat4(1), dvec3(3, -2, 1)), 1.0, dvec3(1, 2, 3));
    twice.instances[0].object_to_world = glm::translate(m, dvec3(-7, -8, -9));
    twice.instances.push_back(twice.instances[0]);
    ASSERT_EQ(build_trace_tables(twice).instances.size(), 2u);
    expect_no_leak(twice, 200000, 4);
}

/// Permutes the nodes of a single hierarchy, and rotates the children of each node by `turn` places.
rays::PackedScene shuffled(rays::PackedScene packed, std::uint32_t turn) {
    const std::size_t stride = shared::kBvhFloatTexels;
    const auto nodes = static_cast<std::uint32_t>(packed.node_count);
    std::vector<std::uint32_t> place(nodes + 1);
    std::iota(place.begin(), place.end(), 0u);
    std::shuffle(place.begin() + 2, place.end(), std::mt19937(turn));  // head and root keep their places
    std::vector<uvec4> moved = packed.nodes;
    for (std::uint32_t n = 1; n <= nodes; ++n) {
        for (std::size_t row = 0; row < stride; ++row) {
            for (std::uint32_t k = 0; k < 4; ++k) {
                std::uint32_t word = packed.nodes[n * stride + row][static_cast<int>((k + turn) % 4)];
                if (row == 6 && (word & shared::kBvhLeaf) == 0)
                    word = shared::kBvhTag | place[word & shared::kBvhIndexMask];
                moved[place[n] * stride + row][static_cast<int>(k)] = word;
            }
        }
    }
    packed.nodes = moved;
    return packed;
}

TEST_F(TracerRules, NoOrderOfTraversalChangesABit) {
    for (const Scene& scene :
         {soup(2000, 0.3f, vec3(1), 9), squares(std::vector<float>(40, 0.0f)), height_field(40, 0.2f)}) {
        const TraceTables tables = build_trace_tables(scene);
        std::vector<Ray> rays = rays_through(tables.bounds, 20000, 10);
        const rays::PackedScene packed = rays::pack_scene(tables, NodeFormat::floating);
        const std::vector<std::uint32_t> reference = bits_of(Tracer(tables, packed).closest(rays));
        for (std::uint32_t turn = 1; turn < 4; ++turn) {
            Tracer other(tables, shuffled(packed, turn));
            EXPECT_TRUE(reference == bits_of(other.closest(rays))) << turn;
        }
    }
}

TEST_F(TracerRules, ListsGiveEqualHits) {
    const TraceTables tables = build_trace_tables(soup(2000, 0.2f, vec3(1), 11));
    const std::vector<Ray> rays = rays_through(tables.bounds, 5000, 12);
    Tracer tracer(tables);
    const std::vector<Hit> hits = tracer.closest(rays);
    const std::vector<std::uint32_t> occluded = tracer.any(rays);
    std::vector<std::uint32_t> list(rays.size());
    std::iota(list.begin(), list.end(), 0u);
    std::shuffle(list.begin(), list.end(), std::mt19937(13));
    list.resize(3001);
    const std::vector<Hit> listed_hits = tracer.closest(rays, &list);
    const std::vector<std::uint32_t> listed_occluded = tracer.any(rays, &list);
    std::vector<char> is_listed(rays.size());
    for (const std::uint32_t path : list) is_listed[path] = 1;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        EXPECT_TRUE(bits_of({listed_hits[i]}) == bits_of({is_listed[i] ? hits[i] : Hit{}})) << i;
        EXPECT_EQ(listed_occluded[i], is_listed[i] ? occluded[i] : 0u) << i;
    }
}

const gpu::ShaderSource kWholeTarget("whole target", R"(
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }
)");
const gpu::ShaderSource kFragmentTracer("fragment tracer", R"(
#include "shaders/trace_scene.glsl"
#include "shaders/lib/traverse.glsl"
uniform samplerBuffer rays;
layout(location = 0) out uvec4 hit_bits;
layout(location = 1) out uvec4 more_bits;
void main() {
    int path = int(gl_FragCoord.y) * 64 + int(gl_FragCoord.x);
    vec4 origin = texelFetch(rays, 2 * path);
    vec4 direction = texelFetch(rays, 2 * path + 1);
    Ray ray = Ray(origin.xyz, origin.w, direction.xyz, direction.w);
    Hit hit = traverse(ray, Sampler(0u, 0u), false);
    hit_bits = uvec4(floatBitsToUint(hit.t), floatBitsToUint(hit.u), floatBitsToUint(hit.v), hit.triangle);
    more_bits = uvec4(hit.instance, traverse(ray, Sampler(0u, 0u), true).triangle != kMiss ? 1u : 0u, 0u, 0u);
}
)");

TEST_F(TracerRules, AFragmentShaderGivesEqualHits) {
    Scene instances = soup(300, 0.2f, vec3(1), 14);
    add_instance(instances, 0, glm::scale(glm::translate(dmat4(1), dvec3(1, 0.5, 0)), dvec3(-1, 2, 1)));
    for (const Scene& scene : {height_field(60, 0.3f), instances}) {
        const TraceTables tables = build_trace_tables(scene);
        for (const NodeFormat format : kFormats) {
            Tracer tracer(tables, format);
            const std::vector<Ray> rays = rays_through(tables.bounds, 64 * 64, 15);
            gpu::Texture bits("hit bits", {.width = 64, .height = 64, .format = GL_RGBA32UI});
            gpu::Texture more("more bits", {.width = 64, .height = 64, .format = GL_RGBA32UI});
            const gpu::Texture* targets[] = {&bits, &more};
            const gpu::Framebuffer framebuffer("hits", targets);
            const gpu::Buffer ray_buffer = gpu::Buffer::from("rays", rays);
            const gpu::Program program = gpu::Program::graphics(kWholeTarget, kFragmentTracer, tracer.scene.defines());
            tracer.scene.bind();
            program.bind_texture("rays", ray_buffer, GL_RGBA32F);
            framebuffer.bind();
            program.draw(GL_TRIANGLES, 3);
            const std::vector<std::uint32_t> a = bits.read_uint(), b = more.read_uint();
            const std::vector<std::uint32_t> hits = bits_of(tracer.closest(rays)), occluded = tracer.any(rays);
            std::size_t different = 0;
            for (std::size_t i = 0; i < rays.size(); ++i) {
                const std::uint32_t fragment[] = {a[4 * i], a[4 * i + 1], a[4 * i + 2], a[4 * i + 3], b[4 * i]};
                different += !std::equal(fragment, fragment + 5, hits.begin() + static_cast<std::ptrdiff_t>(5 * i));
                different += b[4 * i + 1] != occluded[i];
            }
            EXPECT_EQ(different, 0u);
        }
    }
}

}  // namespace
}  // namespace halflight
