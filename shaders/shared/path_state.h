// State of a path between kernels, at its path index.
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

// Component by which light left the first surface. None: the path ended there.
HALFLIGHT_SHARED_CONST uint kLobeNone = 0u;
HALFLIGHT_SHARED_CONST uint kLobeDiffuse = 1u;
HALFLIGHT_SHARED_CONST uint kLobeGlossy = 2u;

struct PathState {
    vec3 throughput;     // throughput of the current ray, including all selection probabilities
    float pdf;           // solid-angle density of the ray in its component times the component's probability; 0: delta
    vec3 direct;         // radiance that the ray from the first surface hits, including the MIS weight
    uint lobe;           // kLobe* of the first surface
    vec3 indirect;       // radiance of all later vertices
    uint pending_light;  // 1: `pending` waits for the result of a shadow ray
    vec3 pending;        // radiance of the last light sample if it is visible
    uint reuse;          // bits of shaders/shared/reuse_groups.h; 0 without path reuse and panes
};
HALFLIGHT_SHARED_SIZE(PathState, 64)

// A light with a size that a scattered ray meets.
struct MetLamp {
    vec3 light;      // radiance that reaches the camera, with the path's throughput and MIS weight; 0: none was met
    float distance;  // distance from the ray's origin; infinite for directional lights
    float group;     // word (word.h): light group; 0 without groups
    uint reserved0;
    uint reserved1;
    uint reserved2;
};
HALFLIGHT_SHARED_SIZE(MetLamp, 32)

// Light at the first surface, by component: sampled there if visible, or received from its group.
struct DirectLight {
    vec3 diffuse;
    float group;  // word (word.h): light group of a sample; 0 without groups
    vec3 glossy;
    float reserved1;
};
HALFLIGHT_SHARED_SIZE(DirectLight, 32)

// Counters of bad values by origin, at index pass * kBadKinds + kind.
HALFLIGHT_SHARED_CONST uint kCountGBuffer = 0u;
HALFLIGHT_SHARED_CONST uint kCountShadow = 1u;
HALFLIGHT_SHARED_CONST uint kCountScatter = 2u;  // diffuse and glossy
HALFLIGHT_SHARED_CONST uint kCountContinuation = 3u;
HALFLIGHT_SHARED_CONST uint kCountReuse = 4u;
HALFLIGHT_SHARED_CONST uint kCountedPasses = 5u;
HALFLIGHT_SHARED_CONST uint kBadNan = 0u;
HALFLIGHT_SHARED_CONST uint kBadInfinite = 1u;
HALFLIGHT_SHARED_CONST uint kBadNegative = 2u;  // radiances and albedos only; normals may be negative
HALFLIGHT_SHARED_CONST uint kBadKinds = 3u;

HALFLIGHT_SHARED_END
