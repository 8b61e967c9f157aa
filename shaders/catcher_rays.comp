// Keeps the shadow rays that are occluded on shadow catchers, and makes all others dead rays.
#include "shaders/shared/frame_block.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/scene_tables.glsl"

layout(local_size_x = 64) in;

layout(std140) uniform FrameBlock { Frame frame; };
layout(std430) buffer ShadowRays { Ray shadow_rays[]; };
uniform usamplerBuffer occluded;  // R32UI: answers to shadow rays

uniform uint paths;  // ray i belongs to path i % paths

#include "shaders/lib/surface_record.glsl"

void main() {
    uint ray = gl_GlobalInvocationID.x;
    bool asks = load_surface_point(ray % paths).catches && texelFetch(occluded, int(ray)).x != kFree;
    if (!asks) shadow_rays[ray].t_max = -1.0;
}
