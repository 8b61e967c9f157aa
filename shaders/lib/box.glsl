// Rays against boxes, conservatively (Ize 2013, Robust BVH Ray Traversal; Woop, Benthin, Wald 2013, section 4).
//
// Monotone: a box inside another one is entered no earlier and left no later, bit for bit, as every step rounds
// monotonically. That is what makes results independent of the order of traversal and of what was culled.
#include "shaders/shared/bvh.h"

// Slab constants per axis, in the units that the bounds are in. Entering and leaving differ by what may be lost to
// rounding, each to the side that makes boxes larger.
struct BoxRay {
    vec3 near_origin;
    vec3 near_inverse;
    vec3 far_origin;
    vec3 far_inverse;
    bvec3 backward;  // the ray runs against the axis: it enters by the upper bound
};

// Distances along a ray are compared as the bits of floats: among those >= 0 the order is that of ints, of which
// processors have a min and max without a care for NaN. Anything negative is below all of them.
struct BoxHits {
    ivec4 near;  // where the ray enters each of four boxes, at least t_min
    bvec4 met;
};

// base, cell: the hierarchy's grid (shaders/shared/bvh.h). slack: bound of the error of positions, relative to the
// greatest distance (maximum norm) between the origin and a point of the hierarchy. direction: not zero.
BoxRay box_ray(vec3 origin, vec3 direction, vec3 base, vec3 cell, float slack) {
    vec3 magnitude = abs(direction);
    // A component below 2^-40 of the greatest one is raised to that. It is met no later than before, and left after the
    // ray has left the hierarchy along the greatest component: slack * 2^40 > 1.
    float least = max(magnitude.x, max(magnitude.y, magnitude.z)) * 9.094947017729282e-13;
    BoxRay ray;
    ray.backward = lessThan(direction, vec3(0.0));
    vec3 side = mix(vec3(1.0), vec3(-1.0), ray.backward);
    vec3 raised = side * max(magnitude, vec3(least));
    vec3 reach = max(abs(base - origin), abs(base + kGridCells * cell - origin));
    // Precise, as t is raised to where boxes are entered: all kernels must get the same bits.
    precise vec3 error = side * (slack * max(reach.x, max(reach.y, reach.z)));
#ifdef HALFLIGHT_NODES_FLOAT
    precise vec3 start = origin;
    precise vec3 inverse = 1.0 / raised;
#else
    precise vec3 start = (origin - base) / cell;
    precise vec3 inverse = cell / raised;
    error /= cell;
#endif
    precise vec3 near_origin = start + error;
    precise vec3 far_origin = start - error;
    precise vec3 near_inverse = inverse * 0.99999952316284180;  // 1 -+ 2^-21: eight roundings
    precise vec3 far_inverse = inverse * 1.0000004768371582;
    ray.near_origin = near_origin;
    ray.far_origin = far_origin;
    ray.near_inverse = near_inverse;
    ray.far_inverse = far_inverse;
    return ray;
}

// Which of four boxes are met within [t_min, t_exit], both >= 0? enter_*, leave_*: their bounds along an axis, those
// first that the ray passes first.
BoxHits intersect_boxes(BoxRay ray, vec4 enter_x, vec4 enter_y, vec4 enter_z, vec4 leave_x, vec4 leave_y, vec4 leave_z,
                        float t_min, float t_exit) {
    precise vec4 near_x = (enter_x - ray.near_origin.x) * ray.near_inverse.x;
    precise vec4 near_y = (enter_y - ray.near_origin.y) * ray.near_inverse.y;
    precise vec4 near_z = (enter_z - ray.near_origin.z) * ray.near_inverse.z;
    precise vec4 far_x = (leave_x - ray.far_origin.x) * ray.far_inverse.x;
    precise vec4 far_y = (leave_y - ray.far_origin.y) * ray.far_inverse.y;
    precise vec4 far_z = (leave_z - ray.far_origin.z) * ray.far_inverse.z;
    BoxHits hits;
    hits.near = max(max(floatBitsToInt(near_x), floatBitsToInt(near_y)),
                    max(floatBitsToInt(near_z), ivec4(floatBitsToInt(t_min))));
    ivec4 far = min(min(floatBitsToInt(far_x), floatBitsToInt(far_y)),
                    min(floatBitsToInt(far_z), ivec4(floatBitsToInt(t_exit))));
    hits.met = lessThanEqual(hits.near, far);
    return hits;
}
