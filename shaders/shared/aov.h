// Data layers per pixel, by path index.
#ifndef HALFLIGHT_SHARED_AOV_H
#define HALFLIGHT_SHARED_AOV_H

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

// Depth of the background, finite, as compositing programs expect.
HALFLIGHT_SHARED_CONST float kNoDepth = 1e10f;

struct AovRecord {
    vec3 position;  // position relative to TraceTables::origin; 0 without a surface
    float depth;    // distance along the camera's axis, world units; kNoDepth where there is no surface
    vec2 motion;    // motion of the point since the previous frame, pixels, x right, y down
    uint triangle;  // id in the tables; kMiss where there is no surface
    uint instance;  // index of the block instance
};
HALFLIGHT_SHARED_SIZE(AovRecord, 32)

// Cost of tracing per pixel, by path index.
struct DebugRecord {
    uint nodes;   // inner nodes, with four boxes each, that the plain tracer visits for the camera ray
    uint leaves;  // leaves in the tile list of the last sample's shadow rays from the surface; 0 without a list
    uint others;  // other entries of that list; 0 without a list
};
HALFLIGHT_SHARED_SIZE(DebugRecord, 12)

HALFLIGHT_SHARED_END

#endif
