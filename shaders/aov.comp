// Stores data outputs of the surfaces at the pixels' centres; HALFLIGHT_MOTION adds motion.
#include "shaders/shared/aov.h"
#include "shaders/shared/frame.h"
#include "shaders/shared/pixel_order.h"
#include "shaders/shared/rays.h"
#include "shaders/scene_tables.glsl"

layout(local_size_x = 64) in;

layout(std140) uniform FrameBlock { Frame frame; };
layout(std430) readonly buffer Hits { Hit hits[]; };
layout(std430) writeonly buffer Records { AovRecord records[]; };

#include "shaders/lib/surface_record.glsl"

void main() {
    uint path = gl_GlobalInvocationID.x;
    SurfacePoint point = load_surface_point(path);
    bool seen = point.is_surface;
    vec3 position = point.position;
    AovRecord record;
    record.position = seen ? position : vec3(0.0);
    record.depth = seen ? dot(position - frame.camera_position.xyz, frame.camera_forward.xyz)
                        : kNoDepth;
    record.motion = vec2(0.0);
#ifdef HALFLIGHT_MOTION
    vec4 before = frame.previous_view_projection * vec4(position, 1.0);
    vec2 here = vec2(pixel_of_path(path, uvec2(frame.tiles_x, frame.tiles_y))) + vec2(0.0, frame.band_y) + frame.jitter;
    vec2 there = (before.xy / before.w * 0.5 + 0.5) * vec2(frame.size);
    // A point that was behind the camera had no place in the picture before.
    if (seen && before.w > 0.0) record.motion = here - there;
#endif
    record.triangle = hits[path].triangle;
    record.instance = hits[path].instance;
    records[path] = record;
}
