// Origins of new rays, offset from the surface by an error bound of the hit instead of a constant (pbrt-v4, section
// 6.8).
#include "shaders/shared/ray_structs.h"

// Returns a bound of the relative error of n float roundings, each of at most 2^-24 (Higham 2002, section 3.1).
float rounding_bound(float n) {
    float e = n * 5.9604644775390625e-8;
    return e / (1.0 - e);
}

// Returns a bound of a hit's distance from the triangle's plane, as caused by rounding of its weights. a, b and c are
// the corners relative to the hit; their distances are r_i. An edge function, the difference of two products, has an
// error of roundings of r_j r_k. The error of a weight is that divided by the doubled area. The hit's error is the sum
// of the weights' errors times r_i, which exceeds roundings of the hit's length only in slivers. The worst case is some
// thirty roundings; many independent ones stay within five (tests/pass/light/test_direct_light.cpp,
// test_shading_surface.cpp). The bound is at most the triangle's smallest height, so that slivers send no ray far away.
//
// With HALFLIGHT_SLIVERS, the tracer uses the triangle's true plane. The remaining errors are those of the offset
// direction in floats. The normal has three roundings of its products and three of its length, and the test of a
// direction's side has four more. A ray with these errors comes closer by as much of its length, which ends at the
// triangle's furthest corner.
float sliver_bound(vec3 a, vec3 b, vec3 c) {
    if (HALFLIGHT_SLIVERS != 0) return rounding_bound(10.0) * sqrt(max(dot(a, a), max(dot(b, b), dot(c, c))));
    float longest = sqrt(max(max(dot(b - a, b - a), dot(c - a, c - a)), max(dot(c - b, c - b), 1e-30)));
    float doubled_area = max(length(cross(b - a, c - a)), 1e-30);
    return min(rounding_bound(6.0) * length(a) * length(b) * length(c) / doubled_area, doubled_area / longest);
}

// Moves a ray's origin to the side of `direction`. offset: Surface::offset; normal: geometric, unit length.
vec3 offset_ray_origin(vec3 position, float offset, vec3 normal, vec3 direction) {
    return position + (dot(normal, direction) < 0.0 ? -offset : offset) * normal;
}

// Returns an endless ray of unit direction from a surface. A marked one may pass back faces (kMarkedRays).
Ray ray_from(vec3 position, float offset, vec3 normal, vec3 direction, bool marked) {
    vec3 origin = offset_ray_origin(position, offset, normal, direction);
    return Ray(origin, marked ? kMarkedStart : 0.0, direction, uintBitsToFloat(0x7f800000u));
}
Ray ray_from(vec3 position, float offset, vec3 normal, vec3 direction) {
    return ray_from(position, offset, normal, direction, false);
}
