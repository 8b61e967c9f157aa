// Path reuse across pixels: the second vertex of a path, for the other paths of its group (shaders/SHADING.md, Path
// reuse).
#pragma once

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

// the path's second vertex was found through a pane
HALFLIGHT_SHARED_CONST uint kReuseThroughPane = 8u;
// the ray's hit is a solid pane that the ray might have passed; set in scenes with solids
HALFLIGHT_SHARED_CONST uint kReuseMetByChance = 16u;

// The second vertex y of a path and the light that leaves it diffusely, at the path's index. SceneNeeds has the size
// with layers.
struct ReusePoint {
    vec3 position;          // position relative to TraceTables::origin
    float offset;           // Surface::offset of the position
    vec3 geometric_normal;  // normal on the side of the incoming path
    float distance;         // distance from the first vertex, > 0
    vec3 direction;         // direction of the ray that found y: unit length, bit for bit as sampled
    float share;            // base_share() towards the ray's origin, > 0
    vec3 light;             // radiance that leaves y diffusely to the ray's origin, without the first surface's BSDF
    float reserved0;
    vec3 pending;  // additional radiance if the last light sample is visible
    float reserved1;
#if HALFLIGHT_LAYER_ROWS                // C++ and kernels without the scene's defines do not read layers
    vec4 layers[HALFLIGHT_LAYER_ROWS];  // pack_layers() in shaders/lib/layers.glsl
#endif
};
HALFLIGHT_SHARED_SIZE(ReusePoint, 80)
HALFLIGHT_SHARED_CONST int kReusePointTexels = 5;  // number of texels of four floats without layers

HALFLIGHT_SHARED_END
