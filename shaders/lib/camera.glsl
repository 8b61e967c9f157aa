// Camera rays (SHADING.md, Camera). Needs shaders/shared/{frame,rays}.h.
#include "shaders/shared/frame.h"
#include "shaders/shared/rays.h"

// Returns the ray through sample point `pixel + frame.jitter` of the whole image; unit direction, clipped to near and
// far.
Ray camera_ray(Frame frame, ivec2 pixel) {
    vec2 at = 2.0 * (vec2(pixel) + frame.jitter) / vec2(frame.size) - 1.0;
    vec3 offset = at.x * frame.camera_right.xyz - at.y * frame.camera_up.xyz;
    bool perspective = frame.camera_position.w != 0.0;
    Ray ray;
    ray.origin = frame.camera_position.xyz + (perspective ? vec3(0.0) : offset);
    vec3 along = perspective ? frame.camera_forward.xyz + offset : frame.camera_forward.xyz;
    float scale = length(along);  // distance along the ray per distance along the camera's axis
    ray.direction = along / scale;
    ray.t_min = frame.clip.x * scale;
    ray.t_max = frame.clip.y * scale;
    return ray;
}
