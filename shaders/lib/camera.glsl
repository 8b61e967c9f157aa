// Camera rays (SHADING.md, Camera).
#include "shaders/shared/frame_block.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/lib/dimensions.glsl"
#include "shaders/lib/path_pixel.glsl"
#include "shaders/lib/sampling.glsl"

const bool kLens = HALFLIGHT_LENS != 0;      // rays start on the lens
const bool kOptics = HALFLIGHT_OPTICS != 0;  // rays follow ray_projections.h; the frame's matrices lead to the camera

// Samples the aperture uniformly: the unit disk, or the regular polygon inscribed in it. An edge crosses the x axis.
vec2 sample_aperture(vec2 xi, float blades) {
    if (blades == 0.0) return sample_disk(xi).xy;
    float at = xi.x * blades;
    float triangle = min(floor(at), blades - 1.0);
    vec2 weights = sample_triangle(vec2(at - triangle, xi.y));
    float angle = 6.283185307180 / blades;
    float first = (triangle - 0.5) * angle, second = (triangle + 0.5) * angle;
    return weights.x * vec2(cos(first), sin(first)) + weights.y * vec2(cos(second), sin(second));
}

// Returns the point of the lens at which the ray through a pixel of the whole image starts, from the lens's centre.
vec3 lens_offset(Frame frame, ivec2 pixel) {
    vec2 p = sample_aperture(sample_2d(pixel_sampler(frame, uvec2(pixel)), kDimensionLens), frame.lens_y.w);
    return p.x * frame.lens_x.xyz + p.y * frame.lens_y.xyz;
}

vec3 from_camera(Frame frame, vec3 v) {
    return v.x * frame.camera_right.xyz + v.y * frame.camera_up.xyz - v.z * frame.camera_forward.xyz;
}

// Returns the ray through sample point `pixel + frame.jitter` of the whole image; unit direction, clipped to near and
// far. A ray that the camera does not see is dead.
Ray camera_ray(Frame frame, ivec2 pixel) {
    Ray ray;
    bool seen = true;
    vec3 along;
    if (kOptics) {
        bool second = shows_second_eye(frame.optics, pixel, frame.size);
        vec2 plane = plane_of_place(frame.optics, second, vec2(pixel) + frame.jitter, frame.size);
        vec3 eye = eye_place(frame.optics, eye_of(frame.optics, second), plane);
        seen = in_image_circle(frame.optics, plane);
        ray.origin = frame.camera_position.xyz + from_camera(frame, eye);
        // Both eyes see the same point at the distance at which they converge.
        along = from_camera(frame, seen_direction(frame.optics, plane) - frame.optics.toe_in * eye);
    } else {
        vec2 at = 2.0 * (vec2(pixel) + frame.jitter) / vec2(frame.size) - 1.0;
        vec3 offset = at.x * frame.camera_right.xyz - at.y * frame.camera_up.xyz;
        bool perspective = frame.camera_position.w != 0.0;
        ray.origin = frame.camera_position.xyz + (perspective ? vec3(0.0) : offset);
        along = perspective ? frame.camera_forward.xyz + offset : frame.camera_forward.xyz;
    }
    if (kLens) {
        // All rays of a sample point meet in the plane of focus.
        vec3 lens = lens_offset(frame, pixel);
        ray.origin += lens;
        along -= lens * frame.lens_x.w;
    }
    float scale = length(along);  // distance along the ray per distance along the camera's axis
    ray.direction = along / scale;
    ray.t_min = frame.clip.x * scale;
    ray.t_max = seen ? frame.clip.y * scale : -1.0;
    return ray;
}

// Returns the pixel of a path in the whole image.
ivec2 pixel_of(Frame frame, uint path) {
    return ivec2(pixel_in_band(frame, path)) + ivec2(frame.band_x, frame.band_y);
}

// Returns the ray of a path.
Ray camera_ray_of_path(Frame frame, uint path) { return camera_ray(frame_of_path(frame, path), pixel_of(frame, path)); }

// Returns the direction of the camera ray of a path that meets a point.
vec3 camera_direction(Frame frame, uint path, vec3 point) {
    if (kOptics) return normalize(point - camera_ray_of_path(frame, path).origin);
    vec3 origin = frame.camera_position.xyz;
    vec3 along = frame.camera_forward.xyz;
    if (kLens) {
        vec3 lens = lens_offset(frame_of_path(frame, path), pixel_of(frame, path));
        origin += lens;
        along = normalize(along - lens * frame.lens_x.w);
    }
    return frame.camera_position.w != 0.0 ? normalize(point - origin) : along;
}

// Returns the depth of a point that a path's camera ray meets: along the camera's axis, or if the projection is
// curved, along the ray.
float camera_depth(Frame frame, uint path, vec3 point) {
    if (kOptics && frame.optics.projection != kPerspective)
        return distance(point, camera_ray_of_path(frame, path).origin);
    return dot(point - frame.camera_position.xyz, frame.camera_forward.xyz);
}

// Returns the depth that a camera ray of this direction gains per distance.
float depth_per_distance(Frame frame, vec3 direction) {
    return kOptics && frame.optics.projection != kPerspective ? 1.0 : dot(direction, frame.camera_forward.xyz);
}
