// The plain tracer: while-while traversal (Aila, Laine 2009), near children first. Needs shaders/trace_scene.glsl.
//
// A ray hits a triangle if intersect_pair() reports t > t_min, and t is < t_max. A t before the entry of the ray into
// the triangle's own box is raised to it. Rays enter the boxes of nodes, which have more slack, no later than that of a
// triangle inside. So hits depend neither on the hierarchy and the format of its nodes nor on the order of traversal,
// and skipping boxes entered beyond the current t changes no hit. The exceptions are triangles split between leaves
// (engine/rays/bvh.h): their t is raised to the entry of the leaf, and the smallest one counts. The lowest (instance,
// triangle) wins ties.
//
// Kernels may define HALFLIGHT_STACK_MORE, entries in addition to the HALFLIGHT_STACK of a traversal.
#include "shaders/shared/ray_structs.h"
#include "shaders/lib/alpha.glsl"
#include "shaders/lib/block_ray.glsl"
#include "shaders/lib/bvh.glsl"
#include "shaders/lib/finite.glsl"
#include "shaders/lib/intersect.glsl"
#include "shaders/lib/light_links.glsl"
#include "shaders/lib/stack_references.glsl"

const bool kPassesPanes = HALFLIGHT_PASS_PANES != 0;      // panes are no hits
const bool kCountsNodes = HALFLIGHT_COUNT != 0;           // nodes_visited is counted
const bool kNotesSlots = HALFLIGHT_TOUCH != 0;            // slots of pages that are read are noted
const bool kOnlyCatchers = HALFLIGHT_CATCHERS_ONLY != 0;  // only shadow catchers are hits; not in pages
// Back faces of one-sided triangles are no hits of rays with t_min > 0, or with kEveryRay of all rays.
const bool kPassesBacks = HALFLIGHT_BACKFACES != 0;

OPTIONAL(HALFLIGHT_TOUCH) layout(std430) writeonly buffer Touched { uint touched_slots[]; };

// Constants of a ray for its entry into the boxes of triangles, per axis of TriangleRay::axes.xy. Along axes.z, t
// itself is no earlier than the entry but for rounding, which the slack of nodes covers.
struct EntryRay {
    vec2 inverse;  // inverse direction
    vec2 error;    // bound of the error of t; a quarter of the slack of nodes, which have more roundings
};

// error: position_error() of the hierarchy
EntryRay entry_ray(TriangleRay ray, vec3 direction, float error) {
    vec3 raised = raised_direction(direction);
    vec2 along = ray.axes.z == 0 ? raised.yz : ray.axes.z == 1 ? raised.zx : raised.xy;
    precise vec2 inverse = 1.0 / along;
    precise vec2 bound = (0.25 * error) * abs(inverse);
    return EntryRay(inverse, bound);
}

// Returns the entry into the box of a pair's triangle. row_x, row_y: as for intersect_pair().
float triangle_near(EntryRay entry, vec3 origin, vec4 row_x, vec4 row_y, bool second) {
    precise vec4 x = row_x - origin.x;
    precise vec4 y = row_y - origin.y;
    precise vec3 t_x = vec3(x.xz, second ? x.w : x.y) * entry.inverse.x;
    precise vec3 t_y = vec3(y.xz, second ? y.w : y.y) * entry.inverse.y;
    precise vec2 near = vec2(min(min(t_x.x, t_x.y), t_x.z), min(min(t_y.x, t_y.y), t_y.z)) - entry.error;
    return max(near.x, near.y);
}

// A triangle as a candidate for the nearest hit.
struct PlaceHit {
    bool nearer;        // true: nearer than `nearest`, or equal t and a lower (instance, triangle)
    bool alpha_tested;
    int next;           // next place: few rays hit both triangles of a pair
    Hit hit;            // hit on the triangle; for any_hit, valid only with kAlpha
};

// Coordinates of the four corners of a pair, by axis of the ray.
struct PairRows {
    vec4 x;
    vec4 y;
    vec4 z;
};

// words: in pages, the pair's texel
PairRows pair_rows(TriangleRay ray, int pair, uvec4 words) {
    if (!kPageNodes) {
        ivec3 texels = pair * kBvhPairTexels + ray.axes;
        return PairRows(texelFetch(trace_triangles, texels.x), texelFetch(trace_triangles, texels.y),
                        texelFetch(trace_triangles, texels.z));
    }
    ivec4 corners = pair / kSlotTexels * (kSlotTexels / 3 * 4) +
                    ivec4(uvec4(words.z, words.z >> kBvhPageCornerBits, words.w, words.w >> kBvhPageCornerBits) &
                          kBvhPageCornerMask);
    vec3 a = along_axes(ray, texelFetch(trace_triangles, corners.x).xyz);
    vec3 b = along_axes(ray, texelFetch(trace_triangles, corners.y).xyz);
    vec3 c = along_axes(ray, texelFetch(trace_triangles, corners.z).xyz);
    vec3 d = along_axes(ray, texelFetch(trace_triangles, corners.w).xyz);
    return PairRows(vec4(a.x, b.x, c.x, d.x), vec4(a.y, b.y, c.y, d.y), vec4(a.z, b.z, c.z, d.z));
}

// Ids of a pair's triangles, and properties of one of them.
struct PairFlags {
    uvec2 ids;  // with other bits above those of kBvhTriangleMask
    uint order;
    bool alpha_tested;
    bool one_sided;
    bool mirrored;
};

PairFlags pair_flags(int pair, uvec4 words, bool second) {
    if (kPageNodes) {
        uvec2 ids = words.xy & (kBvhPageAlpha | kBvhTriangleMask);
        return PairFlags(ids, (second ? words.w : words.z) >> kBvhPageOrderShift,
                         ((second ? ids.y : ids.x) & kBvhPageAlpha) != 0u, (words.x & kBvhPageFacing) != 0u,
                         (words.y & kBvhPageFacing) != 0u);
    }
    uvec4 ids = floatBitsToUint(texelFetch(trace_triangles, pair * kBvhPairTexels + 3));
    uint flags = second ? ids.z >> kBvhFlagShift : ids.z;
    return PairFlags(ids.xy, second ? ids.z >> kBvhOrderShift : ids.z, (flags & kBvhAlphaTested) != 0u,
                     (flags & kBvhOneSided) != 0u, (flags & kBvhMirrored) != 0u);
}

// Intersects one triangle. `leaf_near` is the entry of the ray into the boxes of leaf and instance.
PlaceHit intersect_place(TriangleRay ray, EntryRay entry, int place, uint instance, float t_min, float leaf_near,
                         Hit nearest, const bool any_hit) {
    int pair_index = place >> 1;
    uvec4 words = kPageNodes ? texelFetch(trace_nodes, pair_index) : uvec4(0u);
    PairRows rows = pair_rows(ray, pair_index, words);
    PairEdges pair = intersect_pair(ray, rows.x, rows.y, rows.z);
    bool second = (place & 1) != 0 || !pair.met.x;
    PlaceHit h;
    h.next = (place | 1) + (second || !pair.met.y ? 1 : 0);
    h.nearer = !second || pair.met.y;
    h.alpha_tested = false;
    h.hit = nearest;
    float near = triangle_near(entry, ray.origin, rows.x, rows.y, second);
    if (any_hit && !kAlpha && !kPassesBacks && !kPassesPanes) {
        float t = pair_t(ray, pair, second);
        h.nearer = h.nearer && t > t_min && max(t, near) < nearest.t;
        if (kOnlyCatchers) {
            vec4 both = texelFetch(trace_triangles, pair_index * kBvhPairTexels + 3);
            h.nearer = h.nearer && catches_shadows(floatBitsToUint(second ? both.y : both.x) & kBvhTriangleMask);
        }
        return h;
    }
    PairFlags flags = pair_flags(pair_index, words, second);
    uvec2 ids = flags.ids;
    h.alpha_tested = flags.alpha_tested;
    if (kPassesPanes) h.nearer = h.nearer && !(flags.mirrored && !flags.one_sided);
    if (kPassesBacks) {
        // The places of a pair's second triangle follow its edge functions; those of the first one are the other way
        // round.
        bool in_file_order = ((kBvhEvenOrders >> (flags.order & 15u)) & 1u) != 0u;
        bool back = flags.one_sided && meets_back(ray, edges_of(pair, second), (in_file_order == second) == flags.mirrored);
        h.nearer = h.nearer && !(back && (HALFLIGHT_BACKFACES == kEveryRay || t_min > 0.0));
    }
    uint id = second ? ids.y : ids.x;
    if (ids.x == ids.y) h.next = (place | 1) + 1;  // the pair has a single triangle
    TrianglePoint p = pair_point_in_file_order(ray, pair, second, flags.order);
    h.hit = Hit(p.t, p.weights.y, p.weights.z, id & kBvhTriangleMask, instance);
    h.nearer = h.nearer && p.t > t_min;
    if (kOnlyCatchers) h.nearer = h.nearer && catches_shadows(h.hit.triangle);
    if (any_hit) {
        h.nearer = h.nearer && max(pair_t(ray, pair, second), near) < nearest.t;
    } else {
        h.hit.t = max(p.t, max(near, leaf_near));
        bool wins_tie =
            instance < nearest.instance || (instance == nearest.instance && h.hit.triangle < nearest.triangle);
        h.nearer = h.nearer && (h.hit.t < nearest.t || (h.hit.t == nearest.t && wins_tie));
    }
    return h;
}

// The traversal stack. Kernels that start elsewhere than at the root fill it themselves, far entries first for closest
// hits, and call traverse_from(). They may need HALFLIGHT_STACK_MORE entries in addition to a traversal's. They may
// also push kStackInstance above a node of its block; the node's stack_near is then kBvhFar.
uint stack[HALFLIGHT_STACK + HALFLIGHT_STACK_MORE];
// Any hits need no entries, but llvmpipe searches for them half as fast if entries are not kept.
int stack_near[HALFLIGHT_STACK + HALFLIGHT_STACK_MORE];  // entry of the ray; bits of a float >= 0, like all `near`

// Pushes the met children, from place `first` of their order on.
void put_aside(BvhStep s, const int first, inout int entries, const bool any_hit) {
    for (int i = 3; i >= first; --i) {
        if (s.near[i] < kBvhFar) {
            stack[entries] = s.reference[i];
            stack_near[entries] = s.near[i];
            ++entries;
        }
    }
}

uint nodes_visited = 0u;  // inner nodes, with four boxes each

// References to missing pages have the root of a subtree (engine/paging/page_pool.h). A ray has an order of subtrees:
// by its entry, or 0 for any_hit, and then by root. Of the missing ones that a traversal meets, the first one is kept
// that is not before `searched`.
uvec2 searched = uvec2(0u);  // entry and root; earlier traversals have searched all subtrees before it
uvec2 first_missing = uvec2(uint(kBvhFar), kMiss);

bool is_before(uvec2 a, uvec2 b) { return a.x < b.x || (a.x == b.x && a.y < b.y); }

void note_leaf(uint node, int near) {
    uvec2 subtree = uvec2(uint(near), node & kBvhPageIndexMask);
    bool missing = node >= kBvhPageMissing && node < kBvhPageNoPlace;
    if (missing && is_before(subtree, first_missing) && !is_before(subtree, searched)) first_missing = subtree;
    if (kNotesSlots && places_in(node) > 0) touched_slots[(node & kBvhPageIndexMask) / uint(kSlotTexels)] = 1u;
}

// Returns a miss. It is no constant, because compilers differ in whether intBitsToFloat() is one.
Hit no_hit() { return Hit(intBitsToFloat(kBvhFar), 0.0, 0.0, kMiss, kMiss); }

// Returns the nearest hit among the subtrees of the lowest `entries` of the stack, and `known`, an earlier hit or
// no_hit().
// - any_hit (a constant): stops at the first hit found, of which only `triangle != kMiss` is valid.
// - t is NaN where the driver ended the traversal early.
// - random: alpha_sampler_of_path() of shaders/lib/alpha_sampler.glsl; unused without kAlpha.
//
// Software drivers execute both sides of a branch, and the body of a loop once before they detect that no invocation
// needs it. Therefore loops are tested at their end, and rare work is in the outermost loop, where rays wait for each
// other.
Hit traverse_from(Ray ray, int entries, Hit known, Sampler random, const bool any_hit) {
    uint node = kStackDone;
    int near = floatBitsToInt(ray.t_min);  // entry of the ray into `node`
    int instance_near = near;
    uint instance = 0u;
    if (entries > 0) {
        --entries;
        node = stack[entries];
        near = stack_near[entries];
    }

    BvhHead head = bvh_head(kPageNodes ? top : 0u);
    BoxRay box = box_ray(ray.origin, ray.direction, head.base, head.cell, head.slack);
    TriangleRay sheared = triangle_ray(ray.origin, ray.direction);
    EntryRay entry = entry_ray(sheared, ray.direction, position_error(ray.origin, head.base, head.cell, head.slack));
    float below_t_max = uintBitsToFloat(floatBitsToUint(ray.t_max) - 1u);  // t_max > 0, otherwise there is no hit
    bool found = known.triangle != kMiss;
    Hit nearest = known;
    if (!found) nearest = Hit(ray.t_max, 0.0, 0.0, 0u, 0u);  // loses no tie at t_max
    Hit asked = nearest;  // candidate, which becomes the nearest hit if its triangle covers it
    int asked_place = 0;
    bool asks = false;
    int done = 0;  // 1: the rest of a leaf starts with the second triangle of a pair

    do {
        do {
            do {
                if (node < kStackLeaf) {
                    BvhStep s = bvh_step(box, node, ray.t_min, any_hit ? below_t_max : nearest.t);
                    if (kCountsNodes) ++nodes_visited;
                    put_aside(s, 1, entries, any_hit);
                    node = s.reference.x;
                    near = s.near.x;
                    if (near == kBvhFar) {
                        node = kStackDone;
                        if (entries > 0) {
                            --entries;
                            node = stack[entries];
                            near = stack_near[entries];
                        }
                    }
                }
            } while (node < kStackLeaf);

            if (kPageNodes) note_leaf(node, any_hit ? 0 : near);
            int place = first_place(node);
            int end = place + places_in(node);
            place += done;
            done = 0;
            float leaf_near = intBitsToFloat(max(near, instance_near));
            do {
                if (place < end) {
                    PlaceHit hit = intersect_place(sheared, entry, place, instance, ray.t_min, leaf_near, nearest, any_hit);
                    int tested = place;
                    place = hit.next;
                    if (kAlpha && hit.nearer && hit.alpha_tested) {
                        asked = hit.hit;
                        asked_place = tested;
                        asks = true;
                        done = place & 1;
                        uint left = uint(end - (place - done)) >> 1;
                        // The rest of the leaf. A leaf without pairs must not look like a missing page.
                        node = left > 0u ? leaf_of(left, uint(place >> 1)) : kNoPlace;
                        hit.nearer = false;
                        place = end;
                    }
                    if (hit.nearer) {
                        found = true;
                        if (any_hit) {
                            place = end;
                            entries = 0;
                        } else {
                            nearest = hit.hit;
                        }
                    }
                }
            } while (place < end);

            bool popped = node < kStackBeyond && !asks;
            do {
                if (popped) {
                    node = kStackDone;
                    popped = false;
                    if (entries > 0) {
                        --entries;
                        node = stack[entries];
                        near = stack_near[entries];
                        popped = near > floatBitsToInt(nearest.t);
                    }
                }
            } while (popped);
        } while (node < kStackBeyond && !asks);

        if (kAlpha && asks) {
            asks = false;
            uint row = row_of(asked_place, asked.triangle);
            bool accepts = alpha_accept(triangle_id(asked.triangle), row, asked.instance, asked.u, asked.v, random);
            if (kShadowLinks && any_hit)
                accepts = accepts && blocks_light(set_of_shadow_ray(ray.t_min), class_of_object(row, asked.instance));
            if (accepts) {
                found = true;
                nearest = asked;
                if (any_hit) node = kStackDone;
            }
        }
        if (kTwoLevel && node >= (kBvhTag | kBvhInstance) && node != kStackDone) {
            bool enters = node != kStackLeaveBlock;
            if (enters) instance = node & kBvhIndexMask;
            uint index = enters ? block_head(instance) : 0u;
            Ray inside = ray_in_block(ray, instance);
            vec3 origin = enters ? inside.origin : ray.origin;
            vec3 direction = enters ? inside.direction : ray.direction;
            head = bvh_head(index);
            box = box_ray(origin, direction, head.base, head.cell, head.slack);
            sheared = triangle_ray(origin, direction);
            entry = entry_ray(sheared, direction, position_error(origin, head.base, head.cell, head.slack));
            instance_near = enters ? near : floatBitsToInt(ray.t_min);
            bool at_node = HALFLIGHT_STACK_MORE > 0 && enters && (node & kStackInstance) == kStackInstance;
            if (at_node) --entries;
            uint start = stack[max(entries, 0)];
            if (enters) {
                stack[entries] = kStackLeaveBlock;
                stack_near[entries] = 0;
                ++entries;
                node = at_node ? start : block_root(index);
            } else {
                node = kStackDone;
                if (entries > 0) {
                    --entries;
                    node = stack[entries];
                    near = stack_near[entries];
                }
            }
        }
    } while (node != kStackDone);

    // llvmpipe silently ends the loops of an invocation after 65535 iterations in total. Hits found by then are not a
    // valid result.
    if (node != kStackDone && !(any_hit && found)) return Hit(not_a_number(), 0.0, 0.0, 0u, 0u);
    if (!found) return no_hit();
    return nearest;
}

// Returns the hit of a ray in the whole scene.
Hit traverse(Ray ray, Sampler random, const bool any_hit) {
    stack[0] = top_root();
    stack_near[0] = floatBitsToInt(ray.t_min);
    return traverse_from(ray, ray.t_max >= ray.t_min ? 1 : 0, no_hit(), random, any_hit);
}
