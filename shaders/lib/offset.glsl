// Origins of new rays, off the surface by a bound of the hit's error instead of by a constant (pbrt-v4, section 6.8).
#include "shaders/shared/rays.h"

// n roundings of floats, each of relative error 2^-24 (Higham 2002, section 3.1).
float rounding_bound(float n) {
    float e = n * 5.9604644775390625e-8;
    return e / (1.0 - e);
}

// offset: Surface::offset; normal: geometric, unit. To the side of `direction`.
vec3 offset_ray_origin(vec3 position, float offset, vec3 normal, vec3 direction) {
    return position + (dot(normal, direction) < 0.0 ? -offset : offset) * normal;
}

// A ray of unit direction that goes on from a surface for ever.
Ray ray_from(vec3 position, float offset, vec3 normal, vec3 direction) {
    return Ray(offset_ray_origin(position, offset, normal, direction), 0.0, direction, uintBitsToFloat(0x7f800000u));
}
