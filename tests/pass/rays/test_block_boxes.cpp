// Tests that boxes around boxes of an instance's block are conservative. A ray that meets a box by the block's own test
// must also meet the surrounding box of the instance hierarchy, no later. The shaft of the ray's bundle must meet it,
// too. A random search in float32 uses rotated, flattened and distant instances of all sizes, and boxes that rays just
// graze.
#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include "engine/core/math.h"
#include "engine/rays/packed_bvh.h"
#include "shaders/shared/bvh_nodes.h"
#include "shaders/shared/instance_texels.h"
#include "shaders/shared/texture_units.h"
#include "tests/pass/rays/random_kernel.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

// Each invocation tests one instance and one bundle of rays against 64 boxes.
const std::string kKernel = R"(
#include "shaders/trace_scene.glsl"
#include "shaders/lib/sobol.glsl"
#include "shaders/lib/traverse.glsl"
#include "shaders/lib/chord.glsl"
#include "shaders/lib/block_boxes.glsl"

layout(local_size_x = 64) in;
layout(std430) buffer Counts { uint counts[]; };
layout(std430) readonly buffer Heads { vec4 heads[]; };  // per instance: block's base, cell, hierarchy's base, cell
uniform uint seed;
uniform float margins;  // enlargement of the boxes

const int kRays = 3;

)" + kRandomNumbers + R"(
vec3 to_world(uint instance, vec3 p) {
    vec3 world;
    for (int a = 0; a < 3; ++a) {
        vec4 row = instance_row(instance, kInstanceBlockToWorld, a);
        world[a] = dot(row.xyz, p) + row.w;
    }
    return world;
}

BoxHits meet(Ray ray, BoxRay box, vec4 lower[3], vec4 upper[3]) {
    bvec3 back = box.backward;
    return intersect_boxes(box, back.x ? upper[0] : lower[0], back.y ? upper[1] : lower[1], back.z ? upper[2] : lower[2],
                           back.x ? lower[0] : upper[0], back.y ? lower[1] : upper[1], back.z ? lower[2] : upper[2],
                           ray.t_min, ray.t_max);
}

void main() {
    state = hash_combine(seed, gl_GlobalInvocationID.x);
    uint instance = gl_GlobalInvocationID.x % uint(heads.length() / 4);
    vec4 base = heads[4u * instance], top_base = heads[4u * instance + 2u];
    BvhHead block = BvhHead(base.xyz, heads[4u * instance + 1u].xyz, base.w);
    BvhHead head = BvhHead(top_base.xyz, heads[4u * instance + 3u].xyz, top_base.w);
    ShaftSpace space = shaft_space(head);
    vec3 extent = kGridCells * block.cell;
    vec3 hull = kGridCells * head.cell;

    // Rays with random origins through the block.
    Ray rays[kRays];
    Shaft shaft = Shaft(vec3(1e38), vec3(-1e38), vec3(1e38), vec3(-1e38));
    vec3 origin = head.base + hull * vec3(unit(), unit(), unit());
    if (one_of(3u)) origin += max(hull.x, max(hull.y, hull.z)) * power_of_ten(-2.0, 4.0) * cube();
    if (one_of(3u)) origin = to_world(instance, block.base + extent * (0.5 + cube()));
    vec3 aim = block.base + extent * vec3(unit(), unit(), unit());
    float apart = power_of_ten(-6.0, 0.0);
    for (int r = 0; r < kRays; ++r) {
        vec3 from = origin + (one_of(2u) ? vec3(0.0) : apart * hull * cube());
        vec3 way = to_world(instance, aim + apart * extent * cube()) - from;
        if (one_of(6u)) way[next() % 3u] = 0.0;
        if (one_of(12u)) way[next() % 3u] *= exp2(between(-60.0, -20.0));
        if (way == vec3(0.0)) way.x = 1.0;
        rays[r] = Ray(from, 0.0, way, one_of(2u) ? uintBitsToFloat(0x7f800000u) : between(0.5, 2.0));
        Chord c = chord_of(space, rays[r].origin, rays[r].direction, rays[r].t_max);
        shaft.origin_lower = min(shaft.origin_lower, c.origin);
        shaft.origin_upper = max(shaft.origin_upper, c.origin);
        shaft.end_lower = min(shaft.end_lower, c.end);
        shaft.end_upper = max(shaft.end_upper, c.end);
    }
    ShaftTest test = shaft_test(space, shaft);
    vec3 margin = margins * block_margin(space, shaft);

    uint triples = 0u, met = 0u, lost = 0u;
    for (int turn = 0; turn < 16; ++turn) {
        vec4 lower[3];
        vec4 upper[3];
        for (int b = 0; b < 4; ++b) {
            Ray inside = ray_in_block(rays[next() % uint(kRays)], instance);
            // A point of the ray inside the block.
            vec3 in_0 = (block.base - inside.origin) / inside.direction;
            vec3 in_1 = (block.base + extent - inside.origin) / inside.direction;
            float from = 0.0, to = 1e30;
            for (int a = 0; a < 3; ++a) {
                if (inside.direction[a] == 0.0) continue;
                from = max(from, min(in_0[a], in_1[a]));
                to = min(to, max(in_0[a], in_1[a]));
            }
            vec3 p = inside.origin + mix(from, max(from, to), unit()) * inside.direction;
            float size = power_of_ten(-5.0, 0.0);
            for (int a = 0; a < 3; ++a) {
                float half_size = 0.5 * extent[a] * size;
                float graze = extent[a] * power_of_ten(-8.0, -3.0) * (one_of(2u) ? 1.0 : -1.0);
                float side = one_of(2u) ? 1.0 : -1.0;
                float centre = one_of(2u) ? p[a] + side * (half_size + graze) : p[a] + half_size * between(-1.0, 1.0);
                float l = centre - half_size, u = centre + half_size;
#if !HALFLIGHT_NODES_FLOAT
                l = floor((l - block.base[a]) / block.cell[a]);
                u = ceil((u - block.base[a]) / block.cell[a]);
                float least = 0.0, greatest = kGridCells;
#else
                float least = block.base[a], greatest = block.base[a] + extent[a];
#endif
                lower[a][b] = clamp(l, least, greatest);
                upper[a][b] = clamp(u, least, greatest);
            }
        }
        vec4 around_lower[3];
        vec4 around_upper[3];
        boxes_around(space, block, instance, margin, lower, upper, around_lower, around_upper);
        ShaftInterval interval = shaft_interval(test, around_lower, around_upper);
        for (int r = 0; r < kRays; ++r) {
            Ray inside = ray_in_block(rays[r], instance);
            BoxHits own = meet(inside, box_ray(inside.origin, inside.direction, block.base, block.cell, block.slack), lower, upper);
            BoxHits seen = meet(rays[r], box_ray(rays[r].origin, rays[r].direction, head.base, head.cell, head.slack),
                                around_lower, around_upper);
            for (int b = 0; b < 4; ++b) {
                ++triples;
                met += own.met[b] ? 1u : 0u;
                bool found = seen.met[b] && seen.near[b] <= own.near[b] && interval.enter[b] <= interval.leave[b];
                lost += own.met[b] && !found ? 1u : 0u;
            }
        }
    }
    atomicAdd(counts[0], triples);
    atomicAdd(counts[1], met);
    atomicAdd(counts[2], lost);
}
)";

struct Counts {
    std::uint32_t triples = 0;  // number of tested combinations of a ray, a box of a block, and the surrounding box
    std::uint32_t met = 0;      // triples whose ray meets the inner box
    std::uint32_t lost = 0;     // rays that miss the outer box or meet it later, or whose shaft misses it
};

constexpr int kInstances = 1 << 12;

/// Rows of shaders/shared/instance_texels.h, and the heads that the kernel reads.
struct Instances {
    std::vector<vec4> rows;
    std::vector<vec4> heads;
};

Instances any_instances() {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(0, 1);
    const auto signed_cube = [&] {
        return dvec3(uniform(random) * 2 - 1, uniform(random) * 2 - 1, uniform(random) * 2 - 1);
    };
    const auto power_of_ten = [&](double a, double b) { return std::pow(10, a + (b - a) * uniform(random)); };
    Instances all;
    for (int i = 0; i < kInstances; ++i) {
        const double size = power_of_ten(-3, 3);
        dvec3 half(size);
        for (int a = 0; a < 3; ++a) half[a] *= i % 3 ? power_of_ten(-3, 0) : 1.0;
        dmat4 m = glm::rotate(dmat4(1), uniform(random) * 6, signed_cube() + dvec3(0, 0, 2));
        const double scale = power_of_ten(-3, 3);
        for (int a = 0; a < 3; ++a) m[a] *= scale * (i % 2 ? power_of_ten(-1.5, 0) : 1.0) * (i % 5 ? 1.0 : -1.0);
        m = glm::rotate(m, uniform(random) * 6, signed_cube() + dvec3(2, 0, 0));
        if (i % 7 == 0) m = glm::scale(dmat4(1), dvec3(scale));
        m[3] = dvec4(signed_cube() * scale * size * power_of_ten(-2, 3), 1);
        const glm::mat4 forward(m);
        const dmat4 inverse = glm::inverse(dmat4(forward));

        dvec3 reach(0);  // half extent of the world's box, which is centred at 0
        double norm = 0, inverse_norm = 0;
        for (int r = 0; r < 3; ++r) {
            double sum = 0, inverse_sum = 0;
            reach[r] = std::abs(m[3][r]);
            for (int c = 0; c < 3; ++c) {
                reach[r] += std::abs(m[c][r]) * half[c];
                sum += std::abs(m[c][r]);
                inverse_sum += std::abs(inverse[c][r]);
            }
            norm = std::max(norm, sum);
            inverse_norm = std::max(inverse_norm, inverse_sum);
        }
        reach *= 1 + 2 * uniform(random);
        for (int r = 0; r < 3; ++r) all.rows.emplace_back(forward[0][r], forward[1][r], forward[2][r], forward[3][r]);
        for (int r = 0; r < 3; ++r) {
            all.rows.emplace_back(inverse[0][r], inverse[1][r], inverse[2][r], inverse[3][r]);
        }
        all.rows.emplace_back(0);
        const double cells = shared::kGridCells - 1.0;
        all.heads.emplace_back(-half, 0x1p-19);
        all.heads.emplace_back(2.0 * half / cells, 0);
        all.heads.emplace_back(-reach, 0x1p-17 * norm * inverse_norm);
        all.heads.emplace_back(2.0 * reach / cells, 0);
    }
    return all;
}

using BlockBoxes = GpuTest;

Counts search(bool floating, float margins) {
    gpu::Defines defines{{"HALFLIGHT_TWO_LEVEL", "1"}, {"HALFLIGHT_STACK", "1"}};
    if (floating) defines.set("HALFLIGHT_NODES_FLOAT");
    static const Instances instances = any_instances();
    const gpu::Buffer rows = gpu::Buffer::from("rows", instances.rows);
    const gpu::Buffer heads = gpu::Buffer::from("heads", instances.heads);
    rows.bind_texture(shared::kUnitInstances, GL_RGBA32F);
    return random_search<Counts>(kKernel, defines, 1 << 16, [&](const gpu::Program& program) {
        program.bind_storage("Heads", heads);
        program.set("margins", margins);
    });
}

TEST_F(BlockBoxes, LoseNoBoxThatARayMeets) {
    for (const bool floating : {false, true}) {
        const Counts c = search(floating, 1);
        EXPECT_GE(c.triples, 10'000'000u);
        EXPECT_GT(c.met, c.triples / 10);
        EXPECT_EQ(c.lost, 0u) << (floating ? "floating" : "grid");
    }
}

// Validates the search: with shrunk boxes it finds boxes that are too small.
TEST_F(BlockBoxes, FindsBoxesThatAreTooSmall) {
    for (const bool floating : {false, true}) EXPECT_GT(search(floating, -1).lost, 0u);
}

}  // namespace
}  // namespace halflight
