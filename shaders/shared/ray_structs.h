// Ray, Hit and list structs: one copy for C++ and GLSL.
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

struct Ray {
    vec3 origin;     // start relative to SceneTables::origin, world units
    float t_min;     // >= 0, in units of |direction|
    vec3 direction;  // any length but zero
    float t_max;     // +inf allowed; < t_min: a dead ray, never traced, always a miss
};
HALFLIGHT_SHARED_SIZE(Ray, 32)

struct Hit {
    float t;        // in units of |direction|; +inf: a miss; NaN: the driver stopped the traversal (see kUnfinished)
    float u;        // weight of the triangle's second vertex
    float v;        // weight of the triangle's third vertex
    uint triangle;  // index into TraceTables::triangles; kMiss: nothing was hit
    uint instance;  // index into TraceTables::instances
};
HALFLIGHT_SHARED_SIZE(Hit, 20)

// Head of a list of path indices; its first three words are the arguments of an indirect dispatch of 64-wide groups.
struct ListHeader {
    uint groups_x;  // ceil(count / 64)
    uint groups_y;  // 1
    uint groups_z;  // 1
    uint count;     // entries in use
};
HALFLIGHT_SHARED_SIZE(ListHeader, 16)

HALFLIGHT_SHARED_CONST uint kMiss = 0xffffffffu;

// Rays that pass back faces of one-sided triangles: values of HALFLIGHT_BACKFACES (RayBatch::backfaces).
HALFLIGHT_SHARED_CONST int kMarkedRays = 1;  // rays with t_min > 0
HALFLIGHT_SHARED_CONST int kEveryRay = 2;
// Marks a ray from a surface: t_min, the least normal float.
HALFLIGHT_SHARED_CONST float kMarkedStart = 1.17549435e-38f;

// Greatest probability with which a scattered ray passes a pane (SHADING.md, Panes).
HALFLIGHT_SHARED_CONST float kMostPaneChance = 0.9375f;

// Results of any_hit().
HALFLIGHT_SHARED_CONST uint kFree = 0u;
HALFLIGHT_SHARED_CONST uint kOccluded = 1u;
// the driver stopped the traversal: llvmpipe ends loops at 65535 iterations
HALFLIGHT_SHARED_CONST uint kUnfinished = 2u;

HALFLIGHT_SHARED_END
