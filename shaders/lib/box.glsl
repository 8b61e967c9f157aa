// Conservative tests of rays against boxes (Ize 2013, Robust BVH Ray Traversal; Woop, Benthin, Wald 2013, section 4).
//
// The test is monotone: a box inside another one is entered no earlier and left no later, bit for bit, because every
// step rounds monotonically. Therefore results depend neither on the order of traversal nor on culling.
#include "shaders/lib/node_format.glsl"
#include "shaders/shared/bvh_nodes.h"

const bool kWorldBounds = kFloatNodes || kPageNodes;  // bounds are in the units of the hierarchy's space, not in cells

// Slab constants per axis, in the units of the bounds. Entry and exit are moved apart by the possible rounding errors,
// which makes boxes larger.
struct BoxRay {
    vec3 near_origin;
    vec3 near_inverse;
    vec3 far_origin;
    vec3 far_inverse;
    bvec3 backward;  // true: the ray points against the axis and enters by the upper bound
};

// Distances along a ray are compared as the bits of floats. For values >= 0 the order is that of ints, whose min and
// max need no care for NaN. Negative values are below all others.
struct BoxHits {
    ivec4 near;  // entry of the ray into each of four boxes, at least t_min
    bvec4 met;
};

// Returns a direction without components below 2^-40 of the largest one. Along the axis of a raised component the ray
// enters a box no later than before, and leaves after it has left the hierarchy along the largest component, since
// slack * 2^40 > 1.
vec3 raised_direction(vec3 direction) {
    vec3 magnitude = abs(direction);
    float least = max(magnitude.x, max(magnitude.y, magnitude.z)) * 9.094947017729282e-13;
    return mix(vec3(1.0), vec3(-1.0), lessThan(direction, vec3(0.0))) * max(magnitude, vec3(least));
}

// Returns the bound of the error of positions. base, cell: the hierarchy's grid (shaders/shared/bvh_nodes.h). slack:
// the bound relative to the largest distance (maximum norm) between the origin and a point of the hierarchy.
float position_error(vec3 origin, vec3 base, vec3 cell, float slack) {
    precise vec3 reach = max(abs(base - origin), abs(base + kGridCells * cell - origin));
    precise float error = slack * max(reach.x, max(reach.y, reach.z));
    return error;
}

// Prepares the tests of a ray; `direction` is not zero. For base, cell and slack, see position_error().
BoxRay box_ray(vec3 origin, vec3 direction, vec3 base, vec3 cell, float slack) {
    BoxRay ray;
    ray.backward = lessThan(direction, vec3(0.0));
    vec3 side = mix(vec3(1.0), vec3(-1.0), ray.backward);
    vec3 raised = raised_direction(direction);
    // The code is precise, because t is raised to the entry of boxes: all kernels must get equal bits.
    precise vec3 error = side * position_error(origin, base, cell, slack);
    precise vec3 start = kWorldBounds ? origin : (origin - base) / cell;
    precise vec3 inverse = kWorldBounds ? 1.0 / raised : cell / raised;
    if (!kWorldBounds) error /= cell;
    precise vec3 near_origin = start + error;
    precise vec3 far_origin = start - error;
    // 1 -+ 2^-20: six roundings of 2^-24, and two divisions of 2.5 units in the last place, which GLSL allows.
    precise vec3 near_inverse = inverse * 0.99999904632568359;
    precise vec3 far_inverse = inverse * 1.0000009536743164;
    ray.near_origin = near_origin;
    ray.far_origin = far_origin;
    ray.near_inverse = near_inverse;
    ray.far_inverse = far_inverse;
    return ray;
}

// Tests four boxes against [t_min, t_exit], both >= 0. near_*, far_*: where the ray enters and leaves them per axis.
BoxHits hits_between(vec4 near_x, vec4 near_y, vec4 near_z, vec4 far_x, vec4 far_y, vec4 far_z, float t_min,
                     float t_exit) {
    BoxHits hits;
    hits.near = max(max(floatBitsToInt(near_x), floatBitsToInt(near_y)),
                    max(floatBitsToInt(near_z), ivec4(floatBitsToInt(t_min))));
    ivec4 far = min(min(floatBitsToInt(far_x), floatBitsToInt(far_y)),
                    min(floatBitsToInt(far_z), ivec4(floatBitsToInt(t_exit))));
    hits.met = lessThanEqual(hits.near, far);
    return hits;
}

// Tests four boxes against [t_min, t_exit], both >= 0. enter_*, leave_*: bounds along an axis in the order in which the
// ray passes them.
BoxHits intersect_boxes(BoxRay ray, vec4 enter_x, vec4 enter_y, vec4 enter_z, vec4 leave_x, vec4 leave_y, vec4 leave_z,
                        float t_min, float t_exit) {
    precise vec4 near_x = (enter_x - ray.near_origin.x) * ray.near_inverse.x;
    precise vec4 near_y = (enter_y - ray.near_origin.y) * ray.near_inverse.y;
    precise vec4 near_z = (enter_z - ray.near_origin.z) * ray.near_inverse.z;
    precise vec4 far_x = (leave_x - ray.far_origin.x) * ray.far_inverse.x;
    precise vec4 far_y = (leave_y - ray.far_origin.y) * ray.far_inverse.y;
    precise vec4 far_z = (leave_z - ray.far_origin.z) * ray.far_inverse.z;
    return hits_between(near_x, near_y, near_z, far_x, far_y, far_z, t_min, t_exit);
}
