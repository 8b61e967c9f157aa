// Data outputs per pixel, by path index.
#ifndef HALFLIGHT_SHARED_AOV_H
#define HALFLIGHT_SHARED_AOV_H

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

// Behind everything, and finite, as compositing programs expect.
HALFLIGHT_SHARED_CONST float kNoDepth = 1e10f;

struct AovRecord {
    vec3 position;  // relative to TraceTables::origin; 0 where there is no surface
    float depth;    // distance along the camera's axis, world units; kNoDepth where there is no surface
    vec2 motion;    // pixels, x right, y down: here minus where the point was in the previous frame
    uint triangle;  // of the tables; kMiss where there is no surface
    uint instance;  // block instance
};
HALFLIGHT_SHARED_SIZE(AovRecord, 32)

// What tracing cost, per pixel, by path index.
struct DebugRecord {
    uint nodes;   // inner ones that the plain tracer visits for the camera ray, four boxes each
    uint leaves;  // in the list of the pixel's tile for the last sample's shadow rays from the surface seen;
    uint others;  // both 0 where there is no list
};
HALFLIGHT_SHARED_SIZE(DebugRecord, 12)

HALFLIGHT_SHARED_END

#endif
