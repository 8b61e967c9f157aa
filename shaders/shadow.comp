// Samples lights for every first surface: the sun with HALFLIGHT_SUN_SAMPLES, otherwise HALFLIGHT_SHADOW_RAYS of the
// other lights.
#include "shaders/shared/frame_block.h"
#include "shaders/shared/path_state.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/geometry_tables.glsl"
#include "shaders/scene_tables.glsl"

layout(local_size_x = 64) in;

layout(std140) uniform FrameBlock { Frame frame; };
layout(std430) readonly buffer PrimaryRays { Ray primary_rays[]; };
layout(std430) writeonly buffer ShadowRays { Ray shadow_rays[]; };
layout(std430) writeonly buffer Light { DirectLight light[]; };

#include "shaders/lib/dimensions.glsl"
#include "shaders/lib/next_event.glsl"
#include "shaders/lib/surface_record.glsl"

void main() {
#if HALFLIGHT_SUN_SAMPLES
    const uint rays = 1u;
    uint first_place = HALFLIGHT_SHADOW_RAYS * gl_NumWorkGroups.x * 64u;
#else
    const uint rays = HALFLIGHT_SHADOW_RAYS;
    const uint first_place = 0u;
#endif
    uint ray = gl_GlobalInvocationID.x;
    uint paths = gl_NumWorkGroups.x * 64u / rays;
    uint path = ray % paths;
    SurfacePoint point = load_surface_point(path);
    Bsdf b = load_bsdf(path);
    vec3 wo = -primary_rays[path].direction;
    Sampler random = path_sampler(frame, path);
#if HALFLIGHT_SUN_SAMPLES
    NextEvent e = sample_sun_event(point.position, point.offset, b, wo, vec4(0.0), random,
                                   vertex_dimension(0u, kDimensionLight));
#else
    random.index = random.index * rays + ray / paths;
    NextEvent e = sample_next_event(point.position, point.offset, b, wo, vec4(0.0), random,
                                    vertex_dimension(0u, kDimensionLight), rays);
    e.diffuse /= float(rays);
    e.glossy /= float(rays);
#endif
    bool receives = point.is_surface || point.catches;
    vec3 diffuse = receives ? e.diffuse : vec3(0.0);
    vec3 glossy = receives ? e.glossy : vec3(0.0);
#if HALFLIGHT_LIGHT_GROUPS
    float group = float_of_word(e.group);
#else
    const float group = 0.0;
#endif
    light[first_place + ray] = DirectLight(diffuse, group, glossy, 0.0);
    bool wanted = receives && contributes(e.diffuse + e.glossy);
    if (!wanted) e.ray = kDeadRay;
    shadow_rays[ray] = e.ray;
}
