// The hit record of a triangle that the rasterizer has found. Needs shaders/scene_tables.glsl.
#include "shaders/lib/block_ray.glsl"
#include "shaders/lib/intersect.glsl"
#include "shaders/shared/ray_structs.h"

struct PrimaryHit {
    bool met;   // true: the ray's whole line hits the triangle
    bool back;  // true: the ray meets the side from which the corners are clockwise in block space
    Hit hit;   // record in the tracers' format; for a miss, of the triangle's point beside the ray
};

float positive_up_to(float v, float largest) { return v > 0.0 ? min(v, largest) : 0.0; }  // Returns 0 for NaN.

PrimaryHit primary_hit(Ray ray, uint triangle, uint instance) {
    if (HALFLIGHT_INSTANCES != 0) ray = ray_in_block(ray, instance);
    uvec3 corner = triangle_corners(triangle);
    vec3 a = corner_position(corner.x), b = corner_position(corner.y), c = corner_position(corner.z);
    TriangleHit exact = intersect_triangle(triangle_ray(ray.origin, ray.direction), a, b, c);
    PrimaryHit h;
    h.met = exact.met;
    h.back = exact.back;
    // The rasterizer's snapped edges extend up to 1/256 pixel further. Exactly edge-on the weights are undetermined:
    // any point of the triangle is on the ray, to float precision.
    h.hit.u = positive_up_to(exact.at.weights.y, 1.0);
    h.hit.v = positive_up_to(exact.at.weights.z, 1.0 - h.hit.u);
    vec3 beside = a + h.hit.u * (b - a) + h.hit.v * (c - a) - ray.origin;
    float t_beside = dot(beside, ray.direction) / dot(ray.direction, ray.direction);
    h.hit.t = exact.met ? exact.at.t : t_beside;
    h.hit.triangle = triangle;
    h.hit.instance = instance;
    return h;
}
