// Data layers per pixel, by path index. A layer that needs a new value at the pixel's centre adds a field to AovRecord
// and fills it in aov_record() of shaders/aov.comp; its row in engine/settings/layers.cpp reads it.
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

// Depth of the background, finite, as compositing programs expect.
HALFLIGHT_SHARED_CONST float kNoDepth = 1e10f;

struct AovRecord {
    vec3 position;  // position relative to TraceTables::origin; 0 without a surface
    float depth;    // depth (shaders/lib/camera.glsl, camera_depth()), world units; kNoDepth if there is no surface
    vec2 motion;    // motion of the point since the previous frame, pixels, x right, y down
    uint triangle;  // id in the tables; kMiss if there is no surface
    uint instance;  // index of the block instance
};
HALFLIGHT_SHARED_SIZE(AovRecord, 32)

// Cost of tracing per pixel, by path index.
struct DebugRecord {
    uint nodes;     // inner nodes, with four boxes each, that the plain tracer visits for the camera ray
    uint leaves;    // leaves in the tile list of the last sample's shadow rays from the surface; 0 without a list
    uint others;    // other entries of that list; 0 without a list
    uint subtree;   // number of the subtree of pages around the surface (shaders/lib/residency.glsl); 0: none
    uint resident;  // 1 if that subtree is in the pool
};
HALFLIGHT_SHARED_SIZE(DebugRecord, 20)

HALFLIGHT_SHARED_END
