// Path reuse across pixels: what a path's second vertex has to give to the others of its group (shaders/SHADING.md, Path reuse).
#ifndef HALFLIGHT_SHARED_REUSE_H
#define HALFLIGHT_SHARED_REUSE_H

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

// Pixels 4 apart within an aligned block are a group: of 16 in a block of 16x16, of 8 in 16x8, of 4 in 8x8. Neighbours are
// of different ones, so that what the members of a group have in common does not show as blotches. In the order of paths
// (shaders/shared/pixel_order.h) the low four bits tell the groups of a block apart, the next ones their members.
HALFLIGHT_SHARED_CONST uint kMostGroupSize = 16u;

// size: of groups.
HALFLIGHT_SHARED_FUNCTION uint member_of_path(uint path, uint size) { return (path >> 4) & (size - 1u); }
// A member of the path's group.
HALFLIGHT_SHARED_FUNCTION uint path_of_member(uint path, uint member, uint size) {
    return (path & ~((size - 1u) << 4)) | (member << 4);
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
    float coat;             // Material::coat; 0: none
    float reserved0;
    float reserved1;
    float reserved2;
};
HALFLIGHT_SHARED_SIZE(ReusePoint, 128)
HALFLIGHT_SHARED_CONST int kReusePointTexels = 8;  // of four floats

HALFLIGHT_SHARED_END

#endif
