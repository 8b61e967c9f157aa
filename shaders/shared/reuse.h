// Path reuse across pixels: the second vertex of a path, for the other paths of its group (shaders/SHADING.md, Path
// reuse).
#ifndef HALFLIGHT_SHARED_REUSE_H
#define HALFLIGHT_SHARED_REUSE_H

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

// A group has one pixel of each cell of 4x4 in an aligned block: 16 pixels of a block of 16x16, 8 of 16x8, 4 of 8x8.
// Few neighbours are in the same group, so that correlated noise does not show as blotches. Groups change from time to
// time, so that it does not show as a lattice either.
HALFLIGHT_SHARED_CONST uint kMostGroupSize = 16u;

// Returns the step from a path to another one of its group: path ^ member_step(i, grouping), 0 < i < group size; the
// same step leads back. In the order of paths (shaders/shared/pixel_order.h) the low four bits are the position in a
// cell, and the next ones are the cell. Groups are therefore the cosets of the subgroup spanned by {16, 32, 64, 128}
// with random low bits. `grouping` has 16 random bits.
HALFLIGHT_SHARED_FUNCTION uint member_step(uint i, uint grouping) {
    uint place = 0u;
    for (uint bit = 0u; bit < 4u; ++bit) place ^= ((i >> bit) & 1u) * ((grouping >> (4u * bit)) & 15u);
    return (i << 4) ^ place;
}

// Bits of PathState::reuse.
// the path's second vertex is shared with its group; its light is stored here
HALFLIGHT_SHARED_CONST uint kReusePoint = 1u;
// the light of the rest of the path is shared, too: the path left that vertex diffusely
HALFLIGHT_SHARED_CONST uint kReuseRest = 2u;

// The second vertex y of a path and the light that leaves it diffusely, at the path's index.
struct ReusePoint {
    vec3 position;          // position relative to TraceTables::origin
    float offset;           // Surface::offset of the position
    vec3 geometric_normal;  // normal on the side of the incoming path
    float distance;         // distance from the first vertex, > 0
    vec3 direction;         // direction of the ray that found y: unit length, bit for bit as sampled
    float share;            // diffuse_share() towards the ray's origin, > 0
    vec3 normal;            // shading normal, on the side of the geometric one
    float alpha;            // roughness of the specular lobe
    vec3 light;             // radiance that leaves y diffusely to the ray's origin, without the first surface's BSDF
    float f0;               // largest component of the dielectric's f0
    vec3 pending;           // additional radiance if the last light sample is visible
    float f90;              // f90 of the dielectric
    vec3 coat_normal;
    float coat_alpha;
    float coat;  // Material::coat; 0: none
    float reserved0;
    float reserved1;
    float reserved2;
};
HALFLIGHT_SHARED_SIZE(ReusePoint, 128)
HALFLIGHT_SHARED_CONST int kReusePointTexels = 8;  // number of texels of four floats

HALFLIGHT_SHARED_END

#endif
