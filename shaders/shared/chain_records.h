// Specular chains: the vertices of a path from the camera over mirrors and clear glass to the first other surface.
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

// Largest roughness of mirrors and clear glass. Rougher lobes blur what is behind them over many pixels.
HALFLIGHT_SHARED_CONST float kMostSharpRoughness = 0.1f;
HALFLIGHT_SHARED_CONST int kMostChainBounces = 6;  // a chain ends at this vertex, whatever its surface
// Depth of the environment at the end of a chain over that of the last surface, as a difference of ln(depth).
HALFLIGHT_SHARED_CONST float kEscapedDepth = 1.0f;
// Number of doubles per path that chains add to Accumulated::halves.
HALFLIGHT_SHARED_CONST uint kChainSums = 8u;

// The end of a path's chain. Only `bounces` is set if the first surface is no mirror.
struct SpecularChain {
    vec3 throughput;  // share of the light from the end that reaches the camera
    float bounces;    // number of mirrors and interfaces of glass before the end
    vec3 albedo;      // reflectance of the chain: light from all other branches counts as white
    float way;        // length of the chain behind the first surface, world units; without the way of escaping rays
    vec3 normal;      // shading normal at the end; 0 if the chain escapes
    float escaped;    // 1: the chain ends at the environment; else 0
};
HALFLIGHT_SHARED_SIZE(SpecularChain, 48)

// The place of a chain's end, for motion.
struct ChainPlace {
    vec3 seen;      // place at which the end appears, on the camera ray; relative to TraceTables::origin
    uint triangle;  // id in the tables; kMiss if the chain escapes
    vec3 position;  // place of the end
    uint instance;  // index of the block instance
    vec3 turned_x;  // direction in which `seen` moves when `position` moves along x
    float bounces;  // number of mirrors and interfaces of glass before the end
    vec3 turned_y;
    float reserved0;
    vec3 turned_z;
    float reserved1;
    vec3 facet;  // normal of the first mirror; 0 if the first surface transmits light
    float reserved2;
};
HALFLIGHT_SHARED_SIZE(ChainPlace, 96)

HALFLIGHT_SHARED_END
