// The hit record of a triangle that the rasterizer found, as the tracers would write it.
#include "shaders/shared/rays.h"

// Barycentrics of the ray's intersection with the triangle's plane (Moller and Trumbore 1997), moved onto the triangle:
// the rasterizer's snapped edges reach up to 1/256 pixel further than the exact ones.
Hit primary_hit(Ray ray, uint triangle, uint instance) {
    uvec3 corner = triangle_corners(triangle);
    vec3 a = block_to_world(instance, corner_position(corner.x)) - ray.origin;
    vec3 e1 = block_to_world(instance, corner_position(corner.y)) - ray.origin - a;
    vec3 e2 = block_to_world(instance, corner_position(corner.z)) - ray.origin - a;
    vec3 p = cross(ray.direction, e2);
    float determinant = dot(e1, p);
    vec3 q = cross(a, e1);
    // Seen exactly edge-on nothing tells the barycentrics: any point of the triangle is on the ray as far as floats go.
    float scale = determinant != 0.0 ? 1.0 / determinant : 0.0;
    Hit hit;
    hit.u = clamp(-dot(a, p) * scale, 0.0, 1.0);
    hit.v = clamp(-dot(ray.direction, q) * scale, 0.0, 1.0 - hit.u);
    hit.t = dot(a + hit.u * e1 + hit.v * e2, ray.direction);
    hit.triangle = triangle;
    hit.instance = instance;
    return hit;
}
