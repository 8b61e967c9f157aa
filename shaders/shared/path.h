// State of a path between kernels, at its path index.
#ifndef HALFLIGHT_SHARED_PATH_H
#define HALFLIGHT_SHARED_PATH_H

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST uint kLobeNone = 0u;     // the path ended at the first surface
HALFLIGHT_SHARED_CONST uint kLobeDiffuse = 1u;  // how light left the first surface: decides the component
HALFLIGHT_SHARED_CONST uint kLobeGlossy = 2u;

struct PathState {
    vec3 throughput;   // of the ray now on its way, selection probabilities included
    float pdf;         // solid-angle density of its direction within the component, times the component's probability; 0: delta
    vec3 direct;       // emitter met right after the first surface
    uint lobe;         // kLobe*
    vec3 indirect;     // everything later
    float visibility_pending;  // 1: `pending` waits for the shadow ray's answer
    vec3 pending;      // radiance of the last light sample if it is visible
    float reserved;
};
HALFLIGHT_SHARED_SIZE(PathState, 64)

// Light sampled at the first surface, if it is visible.
struct DirectLight {
    vec3 diffuse;
    float reserved0;
    vec3 glossy;
    float reserved1;
};
HALFLIGHT_SHARED_SIZE(DirectLight, 32)

HALFLIGHT_SHARED_END

#endif
