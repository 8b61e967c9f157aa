// Adds the light samples of one sample to the sums of shadow catchers: the luminance that a white diffuse surface would
// reflect (SHADING.md, Shadow catchers).
#include "shaders/shared/frame_block.h"
#include "shaders/shared/path_state.h"
#include "shaders/scene_tables.glsl"

layout(local_size_x = 64) in;

layout(std140) uniform FrameBlock { Frame frame; };
uniform samplerBuffer light;         // RGBA32F: DirectLight, two texels each
uniform usamplerBuffer occluded;     // R32UI: answers to shadow rays
uniform usamplerBuffer by_catchers;  // R32UI: answers without the objects that are no catchers
uniform usamplerBuffer sun_occluded;
uniform usamplerBuffer sun_by_catchers;
// Per path: light with all objects, light without those that are no catchers, number of samples on catchers, rgb of the
// background behind these, squares of both lights and their product between them.
layout(std430) buffer CatcherSums { double catcher_sums[]; };
layout(std430) buffer Counts { uint bad_values[kCountedPasses * kBadKinds]; };

#include "shaders/lib/guarded_sums.glsl"
#include "shaders/lib/luminance.glsl"
#include "shaders/lib/occlusion.glsl"
#include "shaders/lib/path_pixel.glsl"
#include "shaders/lib/surface_record.glsl"

// Returns the luminance of a light sample, given the answer to its shadow ray.
double luminance_of_sample(int ray, uint answer) {
    vec3 arrives = guarded(answered_light(texelFetch(light, 2 * ray).rgb, answer), kCountShadow);
    return dot(dvec3(arrives), dvec3(kToLuminance));
}

// Adds the sample of a path to the sums of a pixel.
void add(uint path, uint to) {
    SurfacePoint point = load_surface_point(path);
    dvec2 lit = dvec2(0.0);
    if (HALFLIGHT_LIGHT_SAMPLES != 0 && point.catches) {
        uint paths = gl_NumWorkGroups.x * 64u;
        for (uint i = 0u; i < HALFLIGHT_SHADOW_RAYS; ++i) {
            int ray = int(i * paths + path);
            lit.x += luminance_of_sample(ray, texelFetch(occluded, ray).x);
            lit.y += luminance_of_sample(ray, texelFetch(by_catchers, ray).x);
        }
        if (HALFLIGHT_SUN != 0) {
            int sun = int(HALFLIGHT_SHADOW_RAYS * paths + path);
            lit.x += luminance_of_sample(sun, texelFetch(sun_occluded, int(path)).x);
            lit.y += luminance_of_sample(sun, texelFetch(sun_by_catchers, int(path)).x);
        }
    }
    vec3 background = guarded(point.catches ? point.emission : vec3(0.0), kCountGBuffer);
    uint first = to * 9u;
    ADD(catcher_sums[first], lit.x);
    ADD(catcher_sums[first + 1u], lit.y);
    ADD(catcher_sums[first + 2u], point.catches ? 1.0 : 0.0);
    for (uint i = 0u; i < 3u; ++i) ADD(catcher_sums[first + 3u + i], background[i]);
    ADD(catcher_sums[first + 6u], lit.x * lit.x);
    ADD(catcher_sums[first + 7u], lit.x * lit.y);
    ADD(catcher_sums[first + 8u], lit.y * lit.y);
}

void main() {
    uint path = gl_GlobalInvocationID.x;
    if (!kSampledBlocks) {
        add(path, path);
        return;
    }
    // Entries of one block follow each other. The paths of the first entry add the samples of all.
    uint block = sampled_block(path).block;
    bool first = path < 256u || sampled_block(path - 256u).block != block;
    if (!first || block == kNoBlock) return;
    uint to = path_in_band(path);
    for (uint end = gl_NumWorkGroups.x * 64u; path < end && sampled_block(path).block == block; path += 256u)
        add(path, to);
}
