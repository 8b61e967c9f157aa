// Shafts are conservative: whatever box a ray of a bundle meets by the tracer's own test, the bundle's shaft meets,
// too. Looked for by chance in float32, at all scales, with boxes that rays just graze.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include "engine/gpu/buffer.h"
#include "engine/gpu/program.h"
#include "engine/rays/packed_bvh.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

// One hierarchy and one bundle of rays per invocation, 64 boxes each.
const char* const kKernel = R"(
#include "shaders/trace_scene.glsl"
#include "shaders/lib/hash.glsl"
#include "shaders/lib/bvh.glsl"
#include "shaders/lib/shaft.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) buffer Counts { uint counts[]; };
uniform uint seed;
uniform float slack;
uniform float narrower;  // by which shafts are, relative to the reach

const int kRays = 4;
const float kInfinite = uintBitsToFloat(0x7f800000u);

uint state;
uint next() {
    state = state * 747796405u + 2891336453u;
    return hash_u32(state);
}
bool one_of(uint n) { return next() % n == 0u; }
float unit() { return float(next() >> 8) * 5.9604645e-8; }
float between(float a, float b) { return a + (b - a) * unit(); }
float power_of_ten(float a, float b) { return exp2(3.3219281 * between(a, b)); }
vec3 cube() { return vec3(between(-1.0, 1.0), between(-1.0, 1.0), between(-1.0, 1.0)); }
vec3 inside(vec3 lower, vec3 upper) { return mix(lower, upper, vec3(unit(), unit(), unit())); }
float one_sign() { return one_of(2u) ? 1.0 : -1.0; }

struct TestRay {
    vec3 origin;
    vec3 direction;
    float t_max;
};

vec3 lower;  // of the hierarchy, in the world
vec3 extent;
float scale;

vec3 any_direction(vec3 origin) {
    vec3 d = cube();
    bool away = dot(d, d) < 1e-4;
    if (one_of(2u) || away) d = (inside(lower, lower + extent) - origin) / scale;  // across the hierarchy
    for (int a = 0; a < 3; ++a) {
        if (one_of(6u)) d[a] = 0.0;
        if (one_of(12u)) d[a] *= exp2(between(-60.0, -20.0));
    }
    return d == vec3(0.0) ? vec3(0.0, 0.0, 1.0) : d;
}

vec3 any_origin() {
    vec3 o = inside(lower, lower + extent);
    if (one_of(4u)) o += scale * power_of_ten(-2.0, 6.0) * cube();
    if (one_of(4u)) o[next() % 3u] = one_of(2u) ? lower.x : lower.x + extent.x;
    return o;
}

float any_end() { return one_of(2u) ? kInfinite : one_of(4u) ? 0.0 : one_of(2u) ? 1.0 : unit(); }

// Cells of a grid, or world coordinates: what a node may hold.
float coordinate(ShaftSpace space, float v, int axis) {
#ifdef HALFLIGHT_NODES_FLOAT
    return clamp(v, space.lower[axis], space.upper[axis]);
#else
    return clamp(floor(v + 0.5), 0.0, kGridCells);
#endif
}

void main() {
    state = hash_combine(seed, gl_GlobalInvocationID.x);
    scale = power_of_ten(-6.0, 6.0);
    extent = vec3(scale);
    for (int a = 0; a < 3; ++a) extent[a] *= one_of(3u) ? power_of_ten(-6.0, 0.0) : 1.0;
    extent[next() % 3u] = scale;
    lower = -extent * vec3(between(0.0, 1.0), between(0.0, 1.0), between(0.0, 1.0));
    BvhHead head = BvhHead(lower, extent / (kGridCells - 1.0), slack * (one_of(4u) ? power_of_ten(0.0, 3.0) : 1.0));
    ShaftSpace space = shaft_space(head);

    TestRay rays[kRays];
    int count = 2 + int(next() % uint(kRays - 1));
    vec3 origin = any_origin();
    vec3 direction = any_direction(origin);
    float apart = one_of(4u) ? 0.0 : power_of_ten(-8.0, 0.0);
    float spread = one_of(4u) ? 0.0 : power_of_ten(-8.0, 0.0);
    float length = one_of(2u) ? 1.0 : power_of_ten(-6.0, 6.0);
    float end = any_end();
    bool alike = !one_of(4u) && spread < 0.1 && apart < 0.1;
    Shaft shaft = Shaft(vec3(kInfinite), vec3(-kInfinite), vec3(kInfinite), vec3(-kInfinite));
    BoxRay box_rays[kRays];
    Chord chords[kRays];
    for (int r = 0; r < kRays; ++r) {
        if (alike) {
            rays[r] = TestRay(origin + scale * apart * cube(), length * (direction + spread * cube()), end / length * scale);
        } else {
            rays[r].origin = any_origin();
            rays[r] = TestRay(rays[r].origin, length * any_direction(rays[r].origin), any_end() / length * scale);
        }
        Chord c = chord_of(space, rays[r].origin, rays[r].direction, rays[r].t_max);
        chords[r] = c;
        box_rays[r] = box_ray(rays[r].origin, rays[r].direction, head.base, head.cell, head.slack);
        if (r < count) {
            shaft.origin_lower = min(shaft.origin_lower, c.origin);
            shaft.origin_upper = max(shaft.origin_upper, c.origin);
            shaft.end_lower = min(shaft.end_lower, c.end);
            shaft.end_upper = max(shaft.end_upper, c.end);
        }
    }
    if (one_of(2u)) {  // a kept one, which holds more than these rays
        vec3 more_origins = (shaft.origin_upper - shaft.origin_lower) * power_of_ten(-3.0, 0.0);
        vec3 more_ends = (shaft.end_upper - shaft.end_lower) * power_of_ten(-3.0, 0.0);
        shaft.origin_lower -= more_origins * unit();
        shaft.origin_upper += more_origins * unit();
        shaft.end_lower -= more_ends * unit();
        shaft.end_upper += more_ends * unit();
    }
    ShaftTest test = shaft_test(space, shaft);
    vec3 margin = shaft_margin(space, shaft.origin_lower, shaft.origin_upper);
    test.lower += narrower / (head.slack + 3.8146973e-6) * margin;
    test.upper -= narrower / (head.slack + 3.8146973e-6) * margin;

    uint triples = 0u, met = 0u, lost = 0u, far = 0u, rejected = 0u;
    for (int turn = 0; turn < 16; ++turn) {
        bool anywhere = turn >= 14;
        vec4 box_lower[3];
        vec4 box_upper[3];
        for (int b = 0; b < 4; ++b) {
            Chord c = chords[next() % uint(count)];
            // Where the chord begins to be inside the hierarchy, or later.
            vec3 way = c.end - c.origin;
            vec3 in_0 = (space.lower - c.origin) / way;
            vec3 in_1 = (space.upper - c.origin) / way;
            float from = 0.0;
            for (int a = 0; a < 3; ++a) from = way[a] == 0.0 ? from : max(from, min(in_0[a], in_1[a]));
            vec3 p = mix(c.origin, c.end, mix(min(from, 1.0), 1.0, one_of(4u) ? float(next() & 1u) : unit()));
            if (anywhere) p = inside(space.lower, space.upper);
            float size = power_of_ten(-6.0, 0.0);
            for (int a = 0; a < 3; ++a) {
                float half_size = 0.5 * (space.upper[a] - space.lower[a]) * (anywhere ? 0.02 : size);
                float centre = p[a] + half_size * between(-1.0, 1.0);
                float graze = margin[a] * power_of_ten(-4.0, 0.3) * one_sign();
                if (!anywhere && one_of(2u)) centre = p[a] + (half_size + graze) * one_sign();
                float l = coordinate(space, centre - half_size, a);
                float u = max(l, coordinate(space, centre + half_size, a));
                box_lower[a][b] = l;
                box_upper[a][b] = u;
            }
        }
        ShaftInterval interval = shaft_interval(test, box_lower, box_upper);
        bvec4 by_shaft = lessThanEqual(interval.enter, interval.leave);
        bvec4 by_any = bvec4(false);
        for (int r = 0; r < count; ++r) {
            BoxRay ray = box_rays[r];
            bvec3 back = ray.backward;
            BoxHits h = intersect_boxes(ray, back.x ? box_upper[0] : box_lower[0], back.y ? box_upper[1] : box_lower[1],
                                        back.z ? box_upper[2] : box_lower[2], back.x ? box_lower[0] : box_upper[0],
                                        back.y ? box_lower[1] : box_upper[1], back.z ? box_lower[2] : box_upper[2], 0.0,
                                        rays[r].t_max);
            triples += 4u;
            for (int b = 0; b < 4; ++b) {
                by_any[b] = by_any[b] || h.met[b];
                met += h.met[b] ? 1u : 0u;
                lost += h.met[b] && !by_shaft[b] ? 1u : 0u;
            }
        }
        for (int b = 0; b < 4; ++b) {
            bool nobody = anywhere && alike && !by_any[b];
            far += nobody ? 1u : 0u;
            rejected += nobody && !by_shaft[b] ? 1u : 0u;
        }
    }
    atomicAdd(counts[0], triples);
    atomicAdd(counts[1], met);
    atomicAdd(counts[2], lost);
    atomicAdd(counts[3], far);
    atomicAdd(counts[4], rejected);
}
)";

struct Counts {
    std::uint32_t triples = 0;   // a ray, a box, and the shaft of the ray's bundle
    std::uint32_t met = 0;       // the ray meets the box
    std::uint32_t lost = 0;      // and the shaft does not
    std::uint32_t far = 0;       // boxes anywhere that no ray of a coherent bundle meets
    std::uint32_t rejected = 0;  // of these, by the shaft
};

class ShaftTest : public GpuTest {
  protected:
    /// narrower: by which shafts are made so, relative to the reach (shaft_margin).
    static Counts search(rays::NodeFormat format, float narrower, std::uint32_t bundles) {
        gpu::Defines defines;
        if (format == rays::NodeFormat::floating) defines.set("HALFLIGHT_NODES_FLOAT");
        const gpu::Program program = gpu::Program::compute({"shaft test", kKernel}, defines);
        const gpu::Buffer counts("counts", sizeof(Counts));
        counts.bind_storage(0);
        program.set("seed", 1u);
        program.set("slack", 0x1p-20f);  // of hierarchies of triangles; those of instances have more
        program.set("narrower", narrower);
        program.dispatch(bundles / 64);
        glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
        return counts.read<Counts>().front();
    }
};

TEST_F(ShaftTest, LosesNoBoxThatARayMeets) {
    for (const rays::NodeFormat format : {rays::NodeFormat::grid, rays::NodeFormat::floating}) {
        SCOPED_TRACE(format == rays::NodeFormat::grid ? "grid" : "floating");
        const Counts c = search(format, 0, 1 << 17);
        EXPECT_GE(c.triples, 10'000'000u);
        EXPECT_GT(c.met, c.triples / 5);
        EXPECT_EQ(c.lost, 0u);
        // Most of what is far from the bundle is left out.
        EXPECT_GT(c.far, 100'000u);
        EXPECT_GT(c.rejected, c.far * 4ull / 5);
    }
}

// The search finds shafts that are too narrow: without the part of the margin that is for roundings, some are.
TEST_F(ShaftTest, FindsShaftsThatAreTooNarrow) {
    for (const rays::NodeFormat format : {rays::NodeFormat::grid, rays::NodeFormat::floating}) {
        EXPECT_GT(search(format, 0x1p-18f, 1 << 16).lost, 0u);
    }
}

}  // namespace
}  // namespace halflight
