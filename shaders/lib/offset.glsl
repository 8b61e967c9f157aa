// Origins of new rays, off the surface by a bound of the hit's error instead of by a constant (pbrt-v4, section 6.8).
#include "shaders/shared/rays.h"

// n roundings of floats, each of relative error 2^-24 (Higham 2002, section 3.1).
float rounding_bound(float n) {
    float e = n * 5.9604644775390625e-8;
    return e / (1.0 - e);
}

// How far off a triangle's plane the tracer may place a hit by the roundings of its weights. a, b, c: the corners as
// seen from the hit, r their distances. An edge function, the difference of two products, is off by roundings of
// r_j r_k, a weight by that over the doubled area, the hit by the sum of the weights' errors times r_i: more than
// roundings of its length in slivers alone. At worst these are some thirty roundings; being many and independent they
// are met within five (tests/pass/test_direct_light.cpp, test_shading_surface.cpp). At most the triangle's least height,
// so that needles send no ray far away.
#ifdef HALFLIGHT_SLIVERS
// In doubles the tracer sees the triangle's true plane. What is left are floats that say where "off" is: the normal, three
// roundings of its products and three of its length, and whether a direction is on its side, four more. A ray that is off
// by these comes down by as much of its way, which ends at the triangle's furthest corner.
float sliver_bound(vec3 a, vec3 b, vec3 c) {
    return rounding_bound(10.0) * sqrt(max(dot(a, a), max(dot(b, b), dot(c, c))));
}
#else
float sliver_bound(vec3 a, vec3 b, vec3 c) {
    float longest = sqrt(max(max(dot(b - a, b - a), dot(c - a, c - a)), max(dot(c - b, c - b), 1e-30)));
    float doubled_area = max(length(cross(b - a, c - a)), 1e-30);
    return min(rounding_bound(6.0) * length(a) * length(b) * length(c) / doubled_area, doubled_area / longest);
}
#endif

// offset: Surface::offset; normal: geometric, unit. To the side of `direction`.
vec3 offset_ray_origin(vec3 position, float offset, vec3 normal, vec3 direction) {
    return position + (dot(normal, direction) < 0.0 ? -offset : offset) * normal;
}

// A ray of unit direction that goes on from a surface for ever.
Ray ray_from(vec3 position, float offset, vec3 normal, vec3 direction) {
    return Ray(offset_ray_origin(position, offset, normal, direction), 0.0, direction, uintBitsToFloat(0x7f800000u));
}
