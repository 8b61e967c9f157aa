// From the visibility buffer to surfaces in path order; with HALFLIGHT_PRIMARY_RAYS to rays, with HALFLIGHT_PRIMARY_HITS to hits.
#include "shaders/shared/bindings.h"
#include "shaders/shared/frame.h"
#include "shaders/shared/pixel_order.h"
#include "shaders/shared/rays.h"
#include "shaders/scene_tables.glsl"

layout(local_size_x = 64) in;

layout(std140, binding = BLOCK_FRAME) uniform FrameBlock { Frame frame; };
layout(binding = UNIT_FREE) uniform usampler2D visibility;
#ifdef HALFLIGHT_PRIMARY_RAYS
layout(std430, binding = 0) writeonly buffer Rays { Ray rays[]; };
#endif
#ifdef HALFLIGHT_PRIMARY_HITS
layout(std430, binding = 1) writeonly buffer Hits { Hit hits[]; };
#endif
layout(std430, binding = 2) writeonly buffer Surfaces { vec4 surfaces[]; };

#define HALFLIGHT_STORE_SURFACE
#include "shaders/lib/alpha_key.glsl"
#include "shaders/lib/camera.glsl"
#include "shaders/lib/primary_search.glsl"
#include "shaders/lib/surface_record.glsl"
#include "shaders/lib/environment.glsl"

void main() {
    uint path = gl_GlobalInvocationID.x;
    ivec2 pixel = ivec2(pixel_of_path(path, uvec2(frame.tiles_x, frame.tiles_y)));
    bool inside = pixel.x < frame.size.x && pixel.y < frame.band_rows;
    // Beyond the picture's edge the last pixel is looked at again, and then nothing is made of it.
    pixel = min(pixel, ivec2(frame.size.x, frame.band_rows) - 1) + ivec2(0, frame.band_y);
    Ray ray = camera_ray(frame, pixel);
    PrimarySearch seen = search_seen(frame, pixel, ray, alpha_key_of_pixel(frame, pixel, 0u));
    vec3 wo = -ray.direction;
    Hit hit = seen.hit;
    bool is_hit = inside && seen.is_hit && hit.t <= ray.t_max;
    Surface surface = surface_at(hit, ray.direction);
    Material material = evaluate_material(surface, wo);
    Bsdf bsdf = make_bsdf(material, surface.geometric_normal, wo);

    SurfacePoint point;
    point.position = surface.position;
    point.offset = surface.offset;
    point.emission = is_hit ? material.emission : inside ? environment_radiance(ray.direction) : vec3(0.0);
    point.is_surface = is_hit;
    store_surface(path, point, bsdf);
#ifdef HALFLIGHT_PRIMARY_RAYS
    ray.t_max = inside ? ray.t_max : -1.0;
    rays[path] = ray;
#endif
#ifdef HALFLIGHT_PRIMARY_HITS
    hit.triangle = is_hit ? hit.triangle : kMiss;
    hits[path] = hit;
#endif
}
