// Search of a ray among pieces: traversal as in shaders/lib/traverse.glsl, with the same definition of a hit, begun at each
// piece in turn. Needs shaders/trace_scene.glsl.
//
// Variant: as shaders/lib/traverse.glsl.
#include "shaders/shared/raster.h"
#include "shaders/shared/word.h"
#include "shaders/lib/traverse.glsl"

layout(binding = UNIT_RASTER_BOXES) uniform samplerBuffer boxes;

uniform uvec4 candidate_boxes[32];  // indices into boxes, near ones first
#ifdef HALFLIGHT_TWO_LEVEL
uniform uint space_instance;  // where the pieces live; kMiss: at the top level
uniform uint space_door;      // node of the top level that the instance hangs from
#endif

uvec4 bvh_references(uint node) {
#ifdef HALFLIGHT_NODES_FLOAT
    return floatBitsToUint(texelFetch(trace_nodes, int(node) * kBvhFloatTexels + 6));
#else
    return texelFetch(trace_nodes, int(node) * kBvhGridTexels + 3);
#endif
}

// Takes what is not wanted out of a step.
void keep_references(inout BvhStep s, uvec4 wanted) {
    for (int i = 0; i < 4; ++i) {
        if (all(notEqual(uvec4(s.reference[i]), wanted))) s.near[i] = kBvhFar;
    }
}

// Children of up to 32 pieces are put aside at once.
const int kSearchStack = HALFLIGHT_STACK + 4 * 32;

// known: what earlier searches have found, or a miss.
Hit search(Ray ray, uint alpha_key, Hit known, uvec4 candidates, const bool any_hit) {
    uint stack[kSearchStack];
    int stack_near[kSearchStack];
    int entries = 0;
    uint node = kStackDone;
    int near = floatBitsToInt(ray.t_min);
    int instance_near = near;
    uint instance = 0u;
    if (!(ray.t_max >= ray.t_min)) candidates = uvec4(0u);

    BvhHead head = bvh_head(0u);
    BoxRay box = box_ray(ray.origin, ray.direction, head.base, head.cell, head.slack);
    TriangleRay sheared = triangle_ray(ray.origin, ray.direction);
    float below_t_max = uintBitsToFloat(floatBitsToUint(ray.t_max) - 1u);
    bool found = known.triangle != kMiss;
    Hit nearest = Hit(ray.t_max, 0.0, 0.0, 0u, 0u);
    if (found) nearest = known;
#ifdef HALFLIGHT_ALPHA
    Hit asked = nearest;
    bool asks = false;
#else
    const bool asks = false;
#endif

#ifdef HALFLIGHT_TWO_LEVEL
    if (space_instance != kMiss) {
        BvhStep s = bvh_step(box, space_door, ray.t_min, any_hit ? below_t_max : nearest.t);
        keep_references(s, uvec4(kBvhTag | kBvhInstance | space_instance));
        instance_near = min(min(s.near.x, s.near.y), min(s.near.z, s.near.w));
        if (instance_near == kBvhFar) candidates = uvec4(0u);
        instance = space_instance;
        Ray inside = ray_in_block(ray, instance);
        head = bvh_head(floatBitsToUint(instance_row(instance, kInstanceTracer, 0).x) & kBvhIndexMask);
        box = box_ray(inside.origin, inside.direction, head.base, head.cell, head.slack);
        sheared = triangle_ray(inside.origin, inside.direction);
    }
#endif

    bool pieces_left = candidates != uvec4(0u);
    do {
        if (node == kStackDone && pieces_left) {
            // As many pieces as fit, near ones on top of the stack: all, or those of the first leaves.
            uvec4 taken = candidates;
            ivec4 counts = bitCount(candidates);
            if (counts.x + counts.y + counts.z + counts.w > 32) {
                taken.y = counts.x == 0 ? taken.y : 0u;
                taken.z = counts.x + counts.y == 0 ? taken.z : 0u;
                taken.w = counts.x + counts.y + counts.z == 0 ? taken.w : 0u;
            }
            candidates ^= taken;
            pieces_left = candidates != uvec4(0u);
            do {
                int word = taken.w != 0u ? 3 : taken.z != 0u ? 2 : taken.y != 0u ? 1 : 0;
                uint bits = taken[word];
                if (bits != 0u) {
                    uint candidate = uint(findMSB(bits));
                    taken[word] = bits ^ (1u << candidate);
                    candidate += uint(word) * 32u;
                    int texel = int(candidate_boxes[candidate >> 2][candidate & 3u]) * 2;
                    uint piece = word_of_float(texelFetch(boxes, texel).w);
                    uint slots = word_of_float(texelFetch(boxes, texel + 1).w);
                    BvhStep s = bvh_step(box, piece, ray.t_min, any_hit ? below_t_max : nearest.t);
                    bvec4 wanted = notEqual(uvec4(slots) & uvec4(1u, 2u, 4u, 8u), uvec4(0u));
                    keep_references(s, mix(uvec4(kBvhNoChild), bvh_references(piece), wanted));
                    for (int i = 3; i >= 0; --i) {
                        if (s.near[i] < kBvhFar) {
                            stack[entries] = s.reference[i];
                            if (!any_hit) stack_near[entries] = s.near[i];
                            ++entries;
                        }
                    }
                }
            } while (taken != uvec4(0u));
            if (entries > 0) {
                --entries;
                node = stack[entries];
                if (!any_hit) near = stack_near[entries];
            }
        }
        do {
            do {
                if (is_inner_node(node)) {
                    BvhStep s = bvh_step(box, node, ray.t_min, any_hit ? below_t_max : nearest.t);
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
            } while (is_inner_node(node));

            int slot = int(node & kBvhIndexMask);
            int left = is_leaf(node) ? int((node >> kBvhCountShift) & 7u) : 0;
            float leaf_near = intBitsToFloat(max(near, instance_near));
            do {
                if (left > 0) {
                    int texel = slot * 3;
                    vec4 row_x = texelFetch(trace_triangles, texel + sheared.axes.x);
                    vec4 row_y = texelFetch(trace_triangles, texel + sheared.axes.y);
                    vec4 row_z = texelFetch(trace_triangles, texel + sheared.axes.z);
                    TriangleHit hit = intersect_triangle(sheared, row_x.xyz, row_y.xyz, row_z.xyz);
                    uint id = floatBitsToUint(row_x.w);
                    uint triangle = id & kBvhTriangleMask;
                    bool nearer = hit.met && hit.t > ray.t_min;
                    if (any_hit) {
                        nearer = nearer && hit.t < nearest.t;
                    } else {
                        hit.t = max(hit.t, leaf_near);
                        bool wins_tie = instance < nearest.instance ||
                                        (instance == nearest.instance && triangle < nearest.triangle);
                        nearer = nearer && (hit.t < nearest.t || (hit.t == nearest.t && wins_tie));
                    }
                    --left;
                    ++slot;
#ifdef HALFLIGHT_ALPHA
                    if (nearer && (id & kBvhAlphaTested) != 0u) {
                        asked = Hit(hit.t, hit.u, hit.v, triangle, instance);
                        asks = true;
                        node = kBvhTag | kBvhLeaf | uint(left << kBvhCountShift) | uint(slot);  // to be continued
                        nearer = false;
                        left = 0;
                    }
#endif
                    if (nearer) {
                        found = true;
                        if (any_hit) {
                            left = 0;
                            entries = 0;
                            pieces_left = false;
                            nearest.triangle = triangle;
                        } else {
                            nearest = Hit(hit.t, hit.u, hit.v, triangle, instance);
                        }
                    }
                }
            } while (left > 0);

            bool popped = is_leaf(node) && !asks;
            do {
                if (popped) {
                    node = kStackDone;
                    popped = false;
                    if (entries > 0) {
                        --entries;
                        node = stack[entries];
                        if (!any_hit) {
                            near = stack_near[entries];
                            popped = near > floatBitsToInt(nearest.t);
                        }
                    }
                }
            } while (popped);
        } while (node < (kBvhTag | kBvhInstance) && !asks);

#ifdef HALFLIGHT_ALPHA
        if (asks) {
            asks = false;
            if (alpha_accept(asked.triangle, asked.instance, asked.u, asked.v, alpha_key)) {
                found = true;
                nearest = asked;
                if (any_hit) {
                    node = kStackDone;
                    pieces_left = false;
                }
            }
        }
#endif
#ifdef HALFLIGHT_TWO_LEVEL
        if (node >= (kBvhTag | kBvhInstance) && node != kStackDone) {
            bool enters = node != kStackLeaveBlock;
            if (enters) instance = node & kBvhIndexMask;
            uint index = enters ? floatBitsToUint(instance_row(instance, kInstanceTracer, 0).x) & kBvhIndexMask : 0u;
            Ray inside = ray_in_block(ray, instance);
            vec3 origin = enters ? inside.origin : ray.origin;
            vec3 direction = enters ? inside.direction : ray.direction;
            head = bvh_head(index);
            box = box_ray(origin, direction, head.base, head.cell, head.slack);
            sheared = triangle_ray(origin, direction);
            instance_near = enters ? near : floatBitsToInt(ray.t_min);
            if (enters) {
                stack[entries] = kStackLeaveBlock;
                if (!any_hit) stack_near[entries] = 0;
                ++entries;
                node = kBvhTag | (index + 1u);
            } else {
                node = kStackDone;
                if (entries > 0) {
                    --entries;
                    node = stack[entries];
                    if (!any_hit) near = stack_near[entries];
                }
            }
        }
#endif
    } while (node != kStackDone || pieces_left);

    if ((node != kStackDone || pieces_left) && !(any_hit && found)) return Hit(not_a_number(), 0.0, 0.0, 0u, 0u);
    if (!found) return Hit(intBitsToFloat(kBvhFar), 0.0, 0.0, kMiss, kMiss);
    return nearest;
}
