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
    const bool of_sun = HALFLIGHT_SUN_SAMPLES != 0;
    const uint rays = of_sun ? 1u : uint(HALFLIGHT_SHADOW_RAYS);
    uint first_place = of_sun ? HALFLIGHT_SHADOW_RAYS * gl_NumWorkGroups.x * 64u : 0u;
    uint ray = gl_GlobalInvocationID.x;
    uint paths = gl_NumWorkGroups.x * 64u / rays;
    uint path = ray % paths;
    SurfacePoint point = load_surface_point(path);
    Bsdf b = load_bsdf(path);
    vec3 wo = -primary_rays[path].direction;
    Sampler random = path_sampler(frame, path);
    Receiver at = receiver_at(point.position, b.geometric_normal, point.link_class);
    NextEvent e;
    if (of_sun) {
        e = sample_sun_event(at, point.offset, b, wo, vec4(0.0), random,
                             vertex_dimension(0u, kDimensionLight));
    } else {
        random.index = random.index * rays + ray / paths;
        e = sample_next_event(at, point.offset, b, wo, vec4(0.0), random,
                              vertex_dimension(0u, kDimensionLight), rays);
        e.diffuse /= float(rays);
        e.glossy /= float(rays);
    }
    bool receives = point.is_surface || point.catches;
    vec3 diffuse = receives ? e.diffuse : vec3(0.0);
    vec3 glossy = receives ? e.glossy : vec3(0.0);
    float group = kLightGroups > 0u ? float_of_word(e.group) : 0.0;
    light[first_place + ray] = DirectLight(diffuse, group, glossy, 0.0);
    bool wanted = receives && contributes(e.diffuse + e.glossy);
    if (!wanted) e.ray = kDeadRay;
    shadow_rays[ray] = e.ray;
}
