// Stores data outputs of the surfaces at the pixels' centres; HALFLIGHT_MOTION adds motion.
#include "shaders/shared/aov_record.h"
#include "shaders/shared/frame_block.h"
#include "shaders/shared/pixel_order.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/scene_tables.glsl"

layout(local_size_x = 64) in;

layout(std140) uniform FrameBlock { Frame frame; };
layout(std430) readonly buffer Hits { Hit hits[]; };
layout(std430) writeonly buffer Records { AovRecord records[]; };

#include "shaders/lib/camera.glsl"
#include "shaders/lib/surface_record.glsl"

// Returns the motion of a point since the previous frame, pixels; 0 where it has no place in one of the two pictures.
vec2 motion_of(uint path, vec3 position) {
    vec4 before = frame.previous_view_projection * vec4(position, 1.0);
    if (kOptics) {
        bool second = shows_second_eye(frame.optics, pixel_of(frame, path), frame.size);
        float eye = eye_of(frame.optics, second);
        vec3 here = plane_of_point(frame.optics, eye, (frame.view_projection * vec4(position, 1.0)).xyz);
        vec3 there = plane_of_point(frame.optics, eye, before.xyz);
        vec2 way = way_of_plane(frame.optics, second, there.xy / frame.optics.earlier_zoom, here.xy, frame.size);
        return here.z * there.z > 0.0 ? way : vec2(0.0);
    }
    // Rasterized triangles may be seen beside the pixel's ray, so that the point itself is projected, not the pixel.
    vec3 away = position - frame.camera_position.xyz;
    float far = frame.camera_position.w == 0.0 ? 1.0 : dot(away, frame.camera_forward.xyz);
    vec2 plane = vec2(dot(away, frame.camera_right.xyz) / dot(frame.camera_right.xyz, frame.camera_right.xyz),
                      -dot(away, frame.camera_up.xyz) / dot(frame.camera_up.xyz, frame.camera_up.xyz));
    vec2 here = (plane / far * 0.5 + 0.5) * vec2(frame.size);
    vec2 there = (before.xy / before.w * 0.5 + 0.5) * vec2(frame.size);
    return before.w > 0.0 ? here - there : vec2(0.0);
}

AovRecord aov_record(uint path, SurfacePoint point, Hit hit) {
    bool seen = point.is_surface || point.catches;
    vec3 position = seen_position(path, point);
    AovRecord record;
    record.position = seen ? position : vec3(0.0);
    record.depth = seen ? camera_depth(frame, path, position) : kNoDepth;
    record.motion = HALFLIGHT_MOTION != 0 && seen ? motion_of(path, position) : vec2(0.0);
    record.triangle = hit.triangle;
    record.instance = hit.instance;
    return record;
}

void main() {
    uint path = gl_GlobalInvocationID.x;
    records[path] = aov_record(path, load_surface_point(path), hits[path]);
}
