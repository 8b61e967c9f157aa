// The plain tracer: while-while traversal (Aila, Laine 2009), near children first. Needs shaders/trace_scene.glsl.
//
// A triangle is hit by a ray where intersect_triangle says so with a t > t_min, where the boxes of its leaf and of its
// instance are met, and where t, raised to where the ray enters these boxes, is < t_max. With box.glsl's monotone boxes,
// nothing that skips boxes entered beyond the current t, in any order, changes a hit. Among equal t the lowest
// (instance, triangle) wins.
//
// Variant: HALFLIGHT_STACK (entries), HALFLIGHT_TWO_LEVEL (instances), HALFLIGHT_ALPHA (alpha-tested triangles).
#include "shaders/shared/rays.h"
#include "shaders/lib/bvh.glsl"
#include "shaders/lib/intersect.glsl"
#ifdef HALFLIGHT_ALPHA
#include "shaders/lib/alpha.glsl"
#endif

const uint kStackDone = 0xffffffffu;
const uint kStackLeaveBlock = 0x70000000u;  // back to the top level

bool is_inner_node(uint node) { return node < (kBvhTag | kBvhLeaf); }

Hit no_hit() { return Hit(kBvhFar, 0.0, 0.0, kMiss, kMiss); }

#ifdef HALFLIGHT_TWO_LEVEL
// The ray in the space of a block; t is the same in both, as the direction keeps its scale.
Ray ray_in_block(Ray ray, uint instance) {
    vec4 rows[3] = vec4[3](instance_row(instance, kInstanceWorldToBlock, 0),
                           instance_row(instance, kInstanceWorldToBlock, 1),
                           instance_row(instance, kInstanceWorldToBlock, 2));
    precise vec3 origin;
    precise vec3 direction;
    for (int i = 0; i < 3; ++i) {
        origin[i] = rows[i].x * ray.origin.x + rows[i].y * ray.origin.y + rows[i].z * ray.origin.z + rows[i].w;
        direction[i] = rows[i].x * ray.direction.x + rows[i].y * ray.direction.y + rows[i].z * ray.direction.z;
    }
    return Ray(origin, ray.t_min, direction, ray.t_max);
}
#endif

// any_hit (a constant): stops at the first hit found, of which only `triangle != kMiss` has a meaning.
// alpha_key: ray_key() of shaders/lib/hash.glsl; not read without HALFLIGHT_ALPHA.
Hit traverse(Ray ray, uint alpha_key, const bool any_hit) {
    uint stack[HALFLIGHT_STACK];
    float stack_near[HALFLIGHT_STACK];
    int entries = 0;
    uint node = ray.t_max >= ray.t_min ? kBvhTag | 1u : kStackDone;
    float near = ray.t_min;     // where the ray enters `node`
    float t_enter = ray.t_min;  // where it enters the instance
    float below_t_max = uintBitsToFloat(floatBitsToUint(ray.t_max) - 1u);  // t_max > 0, else nothing is met
    uint instance = 0u;

    BvhHead head = bvh_head(0u);
    BoxRay box = box_ray(ray.origin, ray.direction, head.base, head.cell, head.slack);
    TriangleRay triangle = triangle_ray(ray.origin, ray.direction);
    Hit best = Hit(ray.t_max, 0.0, 0.0, 0u, 0u);  // loses no tie at t_max
    bool found = false;

    while (node != kStackDone) {
        while (is_inner_node(node)) {
            BvhStep s = bvh_step(box, node, ray.t_min, any_hit ? below_t_max : best.t, !any_hit);
            for (int i = 3; i > 0; --i) {
                if (s.near[i] < kBvhFar) {
                    stack[entries] = s.reference[i];
                    if (!any_hit) stack_near[entries] = s.near[i];
                    ++entries;
                }
            }
            node = s.reference.x;
            near = s.near.x;
            if (near == kBvhFar) {
                node = kStackDone;
                if (entries > 0) {
                    --entries;
                    node = stack[entries];
                    if (!any_hit) near = stack_near[entries];
                }
            }
        }
#ifdef HALFLIGHT_TWO_LEVEL
        while (node >= (kBvhTag | kBvhInstance) && node != kStackDone) {
            Ray local = ray;
            uint index = 0u;
            bool enters = node != kStackLeaveBlock;
            uint entered = node & kBvhIndexMask;
            instance = enters ? entered : instance;
            Ray inside = ray_in_block(ray, instance);
            index = enters ? floatBitsToUint(instance_row(instance, kInstanceTracer, 0).x) & kBvhIndexMask : 0u;
            if (enters) local = inside;
            head = bvh_head(index);
            box = box_ray(local.origin, local.direction, head.base, head.cell, head.slack);
            triangle = triangle_ray(local.origin, local.direction);
            if (enters) {
                stack[entries] = kStackLeaveBlock;
                if (!any_hit) stack_near[entries] = 0.0;
                ++entries;
                node = kBvhTag | (index + 1u);
                t_enter = near;
            } else {
                t_enter = ray.t_min;
                node = kStackDone;
                if (entries > 0) {
                    --entries;
                    node = stack[entries];
                    if (!any_hit) near = stack_near[entries];
                }
            }
        }
        if (is_inner_node(node)) continue;
#endif
        int slot = int(node & kBvhIndexMask);
        int end = node == kStackDone ? slot : slot + int((node >> kBvhCountShift) & 7u);
        for (; slot < end; ++slot) {
            int texel = slot * 3;
            vec4 row_x = texelFetch(trace_triangles, texel + triangle.axes.x);
            vec4 row_y = texelFetch(trace_triangles, texel + triangle.axes.y);
            vec4 row_z = texelFetch(trace_triangles, texel + triangle.axes.z);
            TriangleHit hit = intersect_triangle(triangle, row_x.xyz, row_y.xyz, row_z.xyz);
            uint id = floatBitsToUint(row_x.w);
            uint index = id & kBvhTriangleMask;
            bool in_range = hit.met && hit.t > ray.t_min;
            bool nearer;
            if (any_hit) {
                nearer = in_range && hit.t < best.t;
            } else {
                hit.t = max(hit.t, max(near, t_enter));
                bool tie = instance < best.instance || (instance == best.instance && index < best.triangle);
                nearer = in_range && (hit.t < best.t || (hit.t == best.t && tie));
            }
#ifdef HALFLIGHT_ALPHA
            for (bool ask = nearer && (id & kBvhAlphaTested) != 0u; ask; ask = false) {
                nearer = alpha_accept(index, instance, hit.u, hit.v, alpha_key);
            }
#endif
            if (nearer) {
                found = true;
                if (!any_hit) best = Hit(hit.t, hit.u, hit.v, index, instance);
                if (any_hit) {
                    end = 0;
                    entries = 0;
                }
            }
        }
        node = kStackDone;
        for (bool more = entries > 0; more;) {
            --entries;
            bool culled = false;
            if (!any_hit) {
                near = stack_near[entries];
                culled = near > best.t;
            }
            if (!culled) node = stack[entries];
            more = culled && entries > 0;
        }
    }
    if (any_hit) return found ? Hit(0.0, 0.0, 0.0, 0u, 0u) : no_hit();
    return found ? best : no_hit();
}
