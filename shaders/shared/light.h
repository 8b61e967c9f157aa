// Lights: rows, alias table, and which light a triangle is.
//
// Rows (UNIT_LIGHTS, RGBA32F), kLightStride texels per light; kinds and indices are words (word.h):
//              triangle                        point, spot, directional          environment
//   texel 0    corner 0, head                  position, head                    -, head
//   texel 1    edge to corner 1, triangle      direction of travel, cos(outer)   -
//   texel 2    edge to corner 2, error bound   1 / (cos(inner) - cos(outer)), -  -
//   texel 3    emission, density per area      intensity, probability            -, probability
// Positions are relative to TraceTables::origin. "Density per area" is the light's probability over its area; the error
// bound says how far, in world units, the triangle may lie off its row's plane in the tracer's arithmetic. The head's
// low bits are the kind; those above are the light's trail in the light tree (light_tree.h), where there is one.
// Probability and density are then those of the alias table alone, which decides where the tree is not asked.
//
// With HALFLIGHT_SUN the last row is a directional light that is not among those to choose from: of probability 1, and
// without an entry in the alias table.
//
// Alias table (UNIT_LIGHT_ALIAS, RG32F; Walker 1977), one entry per light: keep this one where a uniform number is
// below x, else take light y (a word).
//
// Light of a triangle (UNIT_LIGHT_OF_TRIANGLE, R32UI): entry t of the first triangle_count is the rank of triangle t
// among the emissive ones of its block, kNoLight for the others; with HALFLIGHT_INSTANCES entry triangle_count + i is
// the first light of block instance i. The light is the sum of the two.
#ifndef HALFLIGHT_SHARED_LIGHT_H
#define HALFLIGHT_SHARED_LIGHT_H

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST int kLightStride = 4;

HALFLIGHT_SHARED_CONST uint kLightTriangle = 0u;
HALFLIGHT_SHARED_CONST uint kLightPoint = 1u;
HALFLIGHT_SHARED_CONST uint kLightSpot = 2u;
HALFLIGHT_SHARED_CONST uint kLightDirectional = 3u;
HALFLIGHT_SHARED_CONST uint kLightEnvironment = 4u;
HALFLIGHT_SHARED_CONST uint kLightNone = 5u;  // in shaders: nothing was picked

HALFLIGHT_SHARED_CONST uint kLightKindBits = 3u;

HALFLIGHT_SHARED_CONST uint kNoLight = 0xffffffffu;

HALFLIGHT_SHARED_FUNCTION uint light_kind(uint head) {
    return head & ((1u << kLightKindBits) - 1u);
}
HALFLIGHT_SHARED_FUNCTION uint light_trail(uint head) {
    return head >> kLightKindBits;
}

// Where light is to arrive. What picks a light there and what tells the density of that choice look at the same bits.
struct Receiver {
    vec3 position;  // of the surface, relative to TraceTables::origin; not where rays start, which is beside it
    float reserved0;
    vec3 normal;  // geometric, unit, on the side of wo
    float reserved1;
};
HALFLIGHT_SHARED_SIZE(Receiver, 32)

HALFLIGHT_SHARED_END

#endif
