// Path reuse across pixels: what a path's second vertex has to give to the others of its group (shaders/SHADING.md,
// Path reuse).
#ifndef HALFLIGHT_SHARED_REUSE_H
#define HALFLIGHT_SHARED_REUSE_H

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

// A group takes one pixel of each cell of 4x4 within an aligned block: 16 of a block of 16x16, 8 of 16x8, 4 of 8x8. Few
// neighbours are of the same one, so that what the members of a group have in common does not show as blotches, and
// they are others from time to time, so that it does not show as a lattice either.
HALFLIGHT_SHARED_CONST uint kMostGroupSize = 16u;

// From a path to the others of its group: path ^ member_step(i, grouping), 0 < i < size of groups, and back by the same
// step. In the order of paths (shaders/shared/pixel_order.h) the low four bits are the place in a cell, the next ones
// the cell, so that groups are the cosets of the subgroup that {16, 32, 64, 128} with random low bits span. grouping:
// 16 random bits.
HALFLIGHT_SHARED_FUNCTION uint member_step(uint i, uint grouping) {
    uint place = 0u;
    for (uint bit = 0u; bit < 4u; ++bit) place ^= ((i >> bit) & 1u) * ((grouping >> (4u * bit)) & 15u);
    return (i << 4) ^ place;
}

// Bits of PathState::reuse.
HALFLIGHT_SHARED_CONST uint kReusePoint = 1u;  // the path's second vertex is for all of its group, its light lies here
HALFLIGHT_SHARED_CONST uint kReuseRest = 2u;   // so is what the rest of the path brings: it left that vertex diffusely

// The second vertex y of a path and the light that leaves it diffusely, at the path's index.
struct ReusePoint {
    vec3 position;          // relative to TraceTables::origin
    float offset;           // Surface::offset
    vec3 geometric_normal;  // on the side from which the path came
    float distance;         // from the first vertex, > 0
    vec3 direction;         // of the ray that found it: unit, bit for bit as it was sampled
    float share;            // diffuse_share() towards where the ray came from, > 0
    vec3 normal;            // shading normal, on the side of the geometric one
    float alpha;            // of the specular lobe
    vec3 light;             // radiance that leaves y diffusely towards there, without the first surface's BSDF
    float f0;               // of the dielectric: its largest component
    vec3 pending;           // more of it, if the last light sample is visible
    float f90;              // of the dielectric
    vec3 coat_normal;
    float coat_alpha;
    float coat;  // Material::coat; 0: none
    float reserved0;
    float reserved1;
    float reserved2;
};
HALFLIGHT_SHARED_SIZE(ReusePoint, 128)
HALFLIGHT_SHARED_CONST int kReusePointTexels = 8;  // of four floats

HALFLIGHT_SHARED_END

#endif
