// Data layers per pixel, by path index. A layer that needs a new value at the pixel's centre adds a field to AovRecord
// and fills it in aov_record(); its row in engine/settings/layers.cpp reads it.
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

// Returns the record of a path, for kernels that have the frame, shaders/lib/camera.glsl and surface_record.glsl.
#if HALFLIGHT_MAKE_AOV_RECORD
AovRecord aov_record(uint path, SurfacePoint point, Hit hit) {
    bool seen = point.is_surface || point.catches;
    vec3 position = seen_position(path, point);
    AovRecord record;
    record.position = seen ? position : vec3(0.0);
    record.depth = seen ? camera_depth(frame, path, position) : kNoDepth;
    record.motion = vec2(0.0);
#if HALFLIGHT_MOTION && HALFLIGHT_OPTICS
    ivec2 pixel = ivec2(pixel_in_band(frame, path)) + ivec2(frame.band_x, frame.band_y);
    bool second = shows_second_eye(frame.optics, pixel, frame.size);
    float eye = eye_of(frame.optics, second);
    vec3 here = plane_of_point(frame.optics, eye, (frame.view_projection * vec4(position, 1.0)).xyz);
    vec3 there = plane_of_point(frame.optics, eye, (frame.previous_view_projection * vec4(position, 1.0)).xyz);
    vec2 before = there.xy / frame.optics.earlier_zoom;
    if (seen && here.z * there.z > 0.0) record.motion = way_of_plane(frame.optics, second, before, here.xy, frame.size);
#elif HALFLIGHT_MOTION
    vec4 before = frame.previous_view_projection * vec4(position, 1.0);
    // Rasterized triangles may be seen beside the pixel's ray, so that the point itself is projected, not the pixel.
    vec3 away = position - frame.camera_position.xyz;
    float far = frame.camera_position.w == 0.0 ? 1.0 : dot(away, frame.camera_forward.xyz);
    vec2 plane = vec2(dot(away, frame.camera_right.xyz) / dot(frame.camera_right.xyz, frame.camera_right.xyz),
                      -dot(away, frame.camera_up.xyz) / dot(frame.camera_up.xyz, frame.camera_up.xyz));
    vec2 here = (plane / far * 0.5 + 0.5) * vec2(frame.size);
    vec2 there = (before.xy / before.w * 0.5 + 0.5) * vec2(frame.size);
    // A point that was behind the camera had no place in the picture before.
    if (seen && before.w > 0.0) record.motion = here - there;
#endif
    record.triangle = hit.triangle;
    record.instance = hit.instance;
    return record;
}
#endif

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
