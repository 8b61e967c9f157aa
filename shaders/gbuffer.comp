// What camera rays see as surfaces in path order.
//
// Variants: HALFLIGHT_PRIMARY_TRACED (rays and hits are given), else from the visibility buffer: HALFLIGHT_PRIMARY_RAYS and
// HALFLIGHT_PRIMARY_HITS (these are made, too). HALFLIGHT_SEEN: only what they see shining is added to a mean.
#include "shaders/shared/frame.h"
#include "shaders/shared/pixel_order.h"
#include "shaders/shared/rays.h"
#include "shaders/scene_tables.glsl"

layout(local_size_x = 64) in;

layout(std140) uniform FrameBlock { Frame frame; };
#ifdef HALFLIGHT_PRIMARY_TRACED
layout(std430) readonly buffer Rays { Ray rays[]; };
layout(std430) readonly buffer Hits { Hit hits[]; };
#else
uniform usampler2D visibility;
#ifdef HALFLIGHT_PRIMARY_RAYS
layout(std430) writeonly buffer Rays { Ray rays[]; };
#endif
#ifdef HALFLIGHT_PRIMARY_HITS
layout(std430) writeonly buffer Hits { Hit hits[]; };
#endif
#endif
#ifdef HALFLIGHT_SEEN
layout(std430) buffer LightSeen { vec4 light_seen[]; };

uniform float weight;  // of these rays in the mean
uniform bool begins;   // it has nothing of others yet
#else
layout(std430) writeonly buffer Surfaces { vec4 surfaces[]; };

#define HALFLIGHT_STORE_SURFACE
#endif
#ifndef HALFLIGHT_PRIMARY_TRACED
#include "shaders/lib/alpha_key.glsl"
#include "shaders/lib/camera.glsl"
#include "shaders/lib/primary_search.glsl"
#endif
#include "shaders/lib/finite.glsl"
#ifdef HALFLIGHT_SEEN
#include "shaders/lib/material.glsl"
#else
#include "shaders/lib/surface_record.glsl"
#endif
#include "shaders/lib/environment.glsl"

void main() {
    uint path = gl_GlobalInvocationID.x;
    ivec2 pixel = ivec2(pixel_of_path(path, uvec2(frame.tiles_x, frame.tiles_y)));
    bool inside = pixel.x < frame.size.x && pixel.y < frame.band_rows;
#ifdef HALFLIGHT_PRIMARY_TRACED
    Ray ray = rays[path];
    Hit hit = hits[path];
    bool is_hit = hit.triangle != kMiss && finite(hit.t);
    bool unfinished = hit.triangle != kMiss && !is_hit;
    // What sees nothing looks at some triangle too, for nothing: lanes of one register cannot part.
    hit.triangle = is_hit ? hit.triangle : 0u;
    hit.instance = is_hit ? hit.instance : 0u;
#else
    // Beyond the picture's edge the last pixel is looked at again, and then nothing is made of it.
    pixel = min(pixel, ivec2(frame.size.x, frame.band_rows) - 1) + ivec2(0, frame.band_y);
    Ray ray = camera_ray(frame, pixel);
    PrimarySearch seen = search_seen(frame, pixel, ray, alpha_key_of_pixel(frame, pixel, 0u));
    Hit hit = seen.hit;
    bool is_hit = inside && seen.is_hit && hit.t <= ray.t_max;
    const bool unfinished = false;
#endif
    vec3 wo = -ray.direction;
    Surface surface = surface_at(hit, ray.direction);
    Material material = evaluate_material(surface, wo);
    vec3 emission = is_hit ? material.emission : inside ? environment_radiance(ray.direction) : vec3(0.0);
    if (unfinished) emission = vec3(not_a_number());  // to be counted
#ifdef HALFLIGHT_SEEN
    vec4 before = begins ? vec4(0.0) : light_seen[path];
    light_seen[path] = before + weight * vec4(emission, 0.0);
#else
    SurfacePoint point;
    point.position = surface.position;
    point.offset = surface.offset;
    point.emission = emission;
    point.is_surface = is_hit;
    store_surface(path, point, make_bsdf(material, surface.geometric_normal, wo));
#endif
#ifdef HALFLIGHT_PRIMARY_RAYS
    ray.t_max = inside ? ray.t_max : -1.0;
    rays[path] = ray;
#endif
#ifdef HALFLIGHT_PRIMARY_HITS
    hit.triangle = is_hit ? hit.triangle : kMiss;
    hits[path] = hit;
#endif
}
