// Lights: rows, alias table, and the lights of triangles.
//
// Rows (kUnitLights, RGBA32F), kLightStride texels per light; kinds and indices are words (word.h):
//              triangle                        point, spot, directional          environment
//   texel 0    corner 0, head                  position, head                    -, head
//   texel 1    edge to corner 1, triangle      direction of travel, cos(outer)   -
//   texel 2    edge to corner 2, error bound   1 / (cos(inner) - cos(outer)),    -
//                                              size, number, profile
//   texel 3    emission, density per area      intensity, probability            -, probability
// The size is the radius of a point or spot, and the squared sine of half the angle of a directional light. Lights with
// a size come last among those of the second column. The number is that of such lights, without those that the light
// tree holds. It stands in the last row of the column alone.
// Positions are relative to TraceTables::origin. "Density per area" is the light's probability over its area. The error
// bound is the maximum distance, in world units, of the triangle from its row's plane in the tracer's arithmetic. It is
// negative if the corners are clockwise as seen from the triangle's front. The
// head's low bits are the kind; the higher bits are the light's trail in the light tree (light_tree_rows.h), if there
// is one. Probability and density are then those of the alias table alone, which makes the selections that the tree
// does not.
//
// The profile of a point (HALFLIGHT_LIGHT_PROFILES) is the index of the first texel of its header behind all rows; 0: it
// has none. The very last texel behind profiles has the number of texels of rows in x, and -1, which is no probability,
// in w.
//   header         right, first texel of the table; up, -
//   table          texel 0: numbers of vertical angles v and horizontal angles h; then lists of v, h and v x h numbers
//                  (angles in radians, shares of the intensity), each from a new texel on, four numbers per texel
//
// The last row is a directional light outside the selection with HALFLIGHT_SUN. Its probability is 1, and it has no
// entry in the alias table.
//
// Alias table (kUnitLightAlias, RG32F; Walker 1977), one entry per light: keep this light if a uniform number is below
// x, else take light y (a word). Unused with HALFLIGHT_EVERY_LIGHT, where every probability is 1.
//
// Light of a triangle (kUnitLightOfTriangle, R32UI): entry t of the first triangle_count is the rank of triangle t
// among the emissive triangles of its block, or kNoLight. With HALFLIGHT_INSTANCES, entry triangle_count + i is the
// first light of block instance i, and the light is the sum of both.
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST int kLightStride = 4;

HALFLIGHT_SHARED_CONST int kLightProfileHeader = 2;  // texels

HALFLIGHT_SHARED_CONST uint kLightTriangle = 0u;
HALFLIGHT_SHARED_CONST uint kLightPoint = 1u;
HALFLIGHT_SHARED_CONST uint kLightSpot = 2u;
HALFLIGHT_SHARED_CONST uint kLightDirectional = 3u;
HALFLIGHT_SHARED_CONST uint kLightEnvironment = 4u;
HALFLIGHT_SHARED_CONST uint kLightNone = 5u;  // no light was selected; used in shaders only

HALFLIGHT_SHARED_CONST uint kLightKindBits = 3u;

HALFLIGHT_SHARED_CONST uint kNoLight = 0xffffffffu;

HALFLIGHT_SHARED_FUNCTION uint light_kind(uint head) {
    return head & ((1u << kLightKindBits) - 1u);
}
HALFLIGHT_SHARED_FUNCTION uint light_trail(uint head) {
    return head >> kLightKindBits;
}

// A receiver of light. The selection of a light and its density must use equal bits.
struct Receiver {
    vec3 position;     // position on the surface, relative to TraceTables::origin; rays start beside it
    float link_class;  // word: Instance::link_class of the surface; 0 without light links
    vec3 normal;       // geometric normal, unit length, on the side of wo
    float reserved1;
};
HALFLIGHT_SHARED_SIZE(Receiver, 32)

HALFLIGHT_SHARED_END
