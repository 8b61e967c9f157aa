// Tests that shafts are conservative. If a ray of a bundle meets a box by the tracer's own test, the bundle's shaft
// must meet it, too, no later. A random search in float32 covers all scales and uses boxes that rays just graze.
#include <gtest/gtest.h>

#include "engine/rays/packed_bvh.h"
#include "tests/pass/rays/random_kernel.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

// Each invocation has one hierarchy and one bundle of rays, with 64 boxes each. HALFLIGHT_RASTER selects the shafts of
// raster culling.
const std::string kKernel = R"(
#include "shaders/trace_scene.glsl"
#include "shaders/shared/ray_structs.h"
#include "shaders/lib/sobol.glsl"
#include "shaders/lib/bvh.glsl"
#include "shaders/lib/shaft.glsl"
#if HALFLIGHT_RASTER
#include "shaders/lib/raster_shaft.glsl"
#include "shaders/lib/raster_end.glsl"
#else
#include "shaders/lib/chord.glsl"
#endif

layout(local_size_x = 64) in;
layout(std430) buffer Counts { uint counts[]; };
uniform uint seed;
uniform float slack;
uniform float narrower;  // amount by which shafts are made narrower, relative to the reach

#if HALFLIGHT_RASTER
#define ANY_TEST TimedTest
#else
#define ANY_TEST ShaftTest
#endif
const int kRays = 4;
#define INFINITE uintBitsToFloat(0x7f800000u)  // no constant: compilers differ in whether this is one

)" + kRandomNumbers + R"(
vec3 inside(vec3 lower, vec3 upper) { return mix(lower, upper, vec3(unit(), unit(), unit())); }
float one_sign() { return one_of(2u) ? 1.0 : -1.0; }

// The part of a ray that counts, in the shaft's units.
struct Way {
    vec3 from;
    vec3 to;
    float end;  // negative: the ray is said to meet nothing
};

// Bounds of a bundle's ways.
struct Bundle {
    vec3 from_lower;
    vec3 from_upper;
    vec3 to_lower;
    vec3 to_upper;
    float least_end;
};

#if HALFLIGHT_RASTER
Way way_of(BvhHead head, Ray ray) {
    float end = end_of(ray, head);
    return Way(ray.origin, ray.origin + end * ray.direction, end);
}

vec3 node_units(BvhHead head, vec3 p) {
#if HALFLIGHT_NODES_FLOAT
    return p;
#else
    return (p - head.base) / head.cell;
#endif
}

float bundle_reach(BvhHead head, Bundle b) {
    float hull = greatest_of(max(abs(head.base), abs(head.base + kGridCells * head.cell)));
    return shaft_reach(Shaft(b.from_lower, b.from_upper, b.to_lower, b.to_upper), hull);
}

// By how much grazing rays may pass boxes, in the units of nodes.
vec3 margin_of(BvhHead head, Bundle b) {
    vec3 margin = vec3((head.slack + 7.6293945e-6) * bundle_reach(head, b));
#if HALFLIGHT_NODES_FLOAT
    return margin;
#else
    return margin / head.cell;
#endif
}

TimedTest test_of(BvhHead head, Bundle b) {
    TimedShaft shaft = TimedShaft(Shaft(b.from_lower, b.from_upper, b.to_lower, b.to_upper), b.least_end);
    float reach = bundle_reach(head, b);
    TimedTest test = shaft_test(shaft, reach, head.slack);
    test.test.lower += narrower * reach;
    test.test.upper -= narrower * reach;
#if HALFLIGHT_NODES_FLOAT
    return test;
#else
    return TimedTest(scaled_shaft(test.test, head.base, head.cell), test.least_t);
#endif
}

// Where rays enter boxes, at the earliest; infinite where they meet none.
vec4 entered_at(TimedTest test, vec4 lower[3], vec4 upper[3]) {
    ShaftInterval interval = shaft_interval(test.test, lower, upper);
    vec4 at = mix(vec4(INFINITE), interval.enter * test.least_t, lessThanEqual(interval.enter, interval.leave));
    for (int b = 0; b < 4; ++b) {  // as nodes of the CPU's tree are
        float near = shaft_near(test, vec3(lower[0][b], lower[1][b], lower[2][b]),
                                vec3(upper[0][b], upper[1][b], upper[2][b]));
        at[b] = near < 0.0 ? INFINITE : max(at[b], near);
    }
    return at;
}
#else
Way way_of(BvhHead head, Ray ray) {
    Chord c = chord_of(shaft_space(head), ray.origin, ray.direction, ray.t_max);
    return Way(c.origin, c.end, ray.t_max);
}

vec3 node_units(BvhHead head, vec3 p) { return p; }

vec3 margin_of(BvhHead head, Bundle b) { return shaft_margin(shaft_space(head), b.from_lower, b.from_upper); }

ShaftTest test_of(BvhHead head, Bundle b) {
    ShaftTest test = shaft_test(shaft_space(head), Shaft(b.from_lower, b.from_upper, b.to_lower, b.to_upper));
    test.lower += narrower / (head.slack + 7.6293945e-6) * margin_of(head, b);
    test.upper -= narrower / (head.slack + 7.6293945e-6) * margin_of(head, b);
    return test;
}

vec4 entered_at(ShaftTest test, vec4 lower[3], vec4 upper[3]) {
    ShaftInterval interval = shaft_interval(test, lower, upper);
    return mix(vec4(INFINITE), vec4(0.0), lessThanEqual(interval.enter, interval.leave));
}
#endif

vec3 lower;  // lower corner of the hierarchy, in the world
vec3 extent;
float scale;

vec3 any_direction(vec3 origin) {
    vec3 d = cube();
    bool away = dot(d, d) < 1e-4;
    if (one_of(2u) || away) d = (inside(lower, lower + extent) - origin) / scale;  // towards a point of the hierarchy
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

float any_end() { return one_of(2u) ? INFINITE : one_of(4u) ? 0.0 : one_of(2u) ? 1.0 : unit(); }

// Cells of a grid, or world coordinates: what a node may hold.
float coordinate(float v, float least, float greatest) {
#if HALFLIGHT_NODES_FLOAT
    return clamp(v, least, greatest);
#else
    return clamp(floor(v + 0.5), least, greatest);
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
#if HALFLIGHT_NODES_FLOAT
    vec3 least = head.base, greatest = head.base + kGridCells * head.cell;
#else
    vec3 least = vec3(0.0), greatest = vec3(kGridCells);
#endif

    Ray rays[kRays];
    int count = 2 + int(next() % uint(kRays - 1));
    vec3 origin = any_origin();
    vec3 direction = any_direction(origin);
    float apart = one_of(4u) ? 0.0 : power_of_ten(-8.0, 0.0);
    float spread = one_of(4u) ? 0.0 : power_of_ten(-8.0, 0.0);
    float length = one_of(2u) ? 1.0 : power_of_ten(-6.0, 6.0);
    float end = any_end();
    bool alike = !one_of(4u) && spread < 0.1 && apart < 0.1;
    Bundle bundle = Bundle(vec3(INFINITE), vec3(-INFINITE), vec3(INFINITE), vec3(-INFINITE), INFINITE);
    Way ways[kRays];
    for (int r = 0; r < kRays; ++r) {
        if (alike) {
            rays[r] = Ray(origin + scale * apart * cube(), 0.0, length * (direction + spread * cube()), end / length * scale);
        } else {
            rays[r].origin = any_origin();
            rays[r] = Ray(rays[r].origin, 0.0, length * any_direction(rays[r].origin), any_end() / length * scale);
        }
        Way w = way_of(head, rays[r]);
        ways[r] = w;
        if (r < count && w.end >= 0.0) {
            bundle.from_lower = min(bundle.from_lower, w.from);
            bundle.from_upper = max(bundle.from_upper, w.from);
            bundle.to_lower = min(bundle.to_lower, w.to);
            bundle.to_upper = max(bundle.to_upper, w.to);
            bundle.least_end = min(bundle.least_end, w.end);
        }
    }
    if (bundle.from_lower.x > bundle.from_upper.x) return;
    if (one_of(2u)) {  // a shaft that holds more than these rays
        vec3 more_from = (bundle.from_upper - bundle.from_lower) * power_of_ten(-3.0, 0.0);
        vec3 more_to = (bundle.to_upper - bundle.to_lower) * power_of_ten(-3.0, 0.0);
        bundle.from_lower -= more_from * unit();
        bundle.from_upper += more_from * unit();
        bundle.to_lower -= more_to * unit();
        bundle.to_upper += more_to * unit();
    }
    ANY_TEST test = test_of(head, bundle);
    vec3 margin = margin_of(head, bundle);

    uint triples = 0u, met = 0u, lost = 0u, far = 0u, rejected = 0u;
    for (int turn = 0; turn < 16; ++turn) {
        bool anywhere = turn >= 14;
        vec4 box_lower[3];
        vec4 box_upper[3];
        for (int b = 0; b < 4; ++b) {
            Way w = ways[next() % uint(count)];
            vec3 from_here = node_units(head, w.from), to_there = node_units(head, w.to);
            // Where the way begins to be inside the hierarchy, or later.
            vec3 way = to_there - from_here;
            vec3 in_0 = (least - from_here) / way;
            vec3 in_1 = (greatest - from_here) / way;
            float from = 0.0;
            for (int a = 0; a < 3; ++a) from = way[a] == 0.0 ? from : max(from, min(in_0[a], in_1[a]));
            vec3 p = mix(from_here, to_there, mix(min(from, 1.0), 1.0, one_of(4u) ? float(next() & 1u) : unit()));
            if (anywhere) p = inside(least, greatest);
            float size = power_of_ten(-6.0, 0.0);
            for (int a = 0; a < 3; ++a) {
                float half_size = 0.5 * (greatest[a] - least[a]) * (anywhere ? 0.02 : size);
                float centre = p[a] + half_size * between(-1.0, 1.0);
                float graze = margin[a] * power_of_ten(-4.0, 0.3) * one_sign();
                if (!anywhere && one_of(2u)) centre = p[a] + (half_size + graze) * one_sign();
                float l = coordinate(centre - half_size, least[a], greatest[a]);
                float u = max(l, coordinate(centre + half_size, least[a], greatest[a]));
                box_lower[a][b] = l;
                box_upper[a][b] = u;
            }
        }
        vec4 at = entered_at(test, box_lower, box_upper);
        bvec4 by_any = bvec4(false);
        for (int r = 0; r < count; ++r) {
            // Lavapipe cannot create pipelines with arrays of this struct, which has booleans.
            BoxRay ray = box_ray(rays[r].origin, rays[r].direction, head.base, head.cell, head.slack);
            bvec3 back = ray.backward;
            BoxHits h = intersect_boxes(ray, back.x ? box_upper[0] : box_lower[0], back.y ? box_upper[1] : box_lower[1],
                                        back.z ? box_upper[2] : box_lower[2], back.x ? box_lower[0] : box_upper[0],
                                        back.y ? box_lower[1] : box_upper[1], back.z ? box_lower[2] : box_upper[2], 0.0,
                                        rays[r].t_max);
            triples += 4u;
            for (int b = 0; b < 4; ++b) {
                by_any[b] = by_any[b] || h.met[b];
                met += h.met[b] ? 1u : 0u;
                lost += h.met[b] && (!(at[b] <= intBitsToFloat(h.near[b])) || ways[r].end < 0.0) ? 1u : 0u;
            }
        }
        for (int b = 0; b < 4; ++b) {
            bool nobody = anywhere && alike && !by_any[b];
            far += nobody ? 1u : 0u;
            rejected += nobody && at[b] == INFINITE ? 1u : 0u;
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
    std::uint32_t triples = 0;   // number of tested combinations of a ray, a box, and the shaft of the ray's bundle
    std::uint32_t met = 0;       // triples whose ray meets the box
    std::uint32_t lost = 0;      // boxes that a ray meets, and that the shaft misses or meets later
    std::uint32_t far = 0;       // random boxes that no ray of a coherent bundle meets
    std::uint32_t rejected = 0;  // far boxes that the shaft rejects
};

constexpr float kSlack = 0x1p-19f;  // margin for hierarchies of triangles; instances have a larger one

/// Kind of shaft and of node.
struct Kind {
    const char* name;
    bool raster;
    rays::NodeFormat format;
    float too_much;  // narrowing, relative to the reach, that loses boxes
};
// The narrowings exceed the part of the margin for rounding, or the padding.
constexpr Kind kKinds[] = {{"tiles, grid", false, rays::NodeFormat::grid, 0x1p-17f},
                           {"tiles, floating", false, rays::NodeFormat::floating, 0x1p-17f},
                           {"raster, grid", true, rays::NodeFormat::grid, 4 * kSlack + 0x1p-17f},
                           {"raster, floating", true, rays::NodeFormat::floating, 4 * kSlack + 0x1p-17f}};

using ShaftTest = GpuTest;

/// Counts results over `bundles` random bundles. `narrower` is a narrowing of the shafts relative to the reach.
Counts search(const Kind& kind, float narrower, std::uint32_t bundles) {
    gpu::Defines defines;
    if (kind.format == rays::NodeFormat::floating) defines.set("HALFLIGHT_NODES_FLOAT");
    if (kind.raster) defines.set("HALFLIGHT_RASTER");
    return random_search<Counts>(kKernel, defines, bundles, [&](const gpu::Program& program) {
        program.set("slack", kSlack);
        program.set("narrower", narrower);
    });
}

TEST_F(ShaftTest, LosesNoBoxThatARayMeets) {
    for (const Kind& kind : kKinds) {
        SCOPED_TRACE(kind.name);
        const Counts c = search(kind, 0, 1 << 17);
        EXPECT_GE(c.triples, 10'000'000u);
        EXPECT_GT(c.met, c.triples / 5);
        EXPECT_EQ(c.lost, 0u);
        // The shaft rejects most boxes far from the bundle.
        EXPECT_GT(c.far, 100'000u);
        EXPECT_GT(c.rejected, c.far * 4ull / 5);
    }
}

// Validates the search: with narrowed shafts it finds lost boxes.
TEST_F(ShaftTest, FindsShaftsThatAreTooNarrow) {
    for (const Kind& kind : kKinds) {
        EXPECT_GT(search(kind, kind.too_much, 1 << 16).lost, 0u) << kind.name;
    }
}

}  // namespace
}  // namespace halflight
