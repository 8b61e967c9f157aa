// Adds one sample to the sums of its pixel; sample 0 of a frame begins them. No NaN or infinity gets into them: such values are
// counted, by the pass they come from, and taken as zero.
#include "shaders/shared/frame.h"
#include "shaders/shared/path.h"
#include "shaders/scene_tables.glsl"

layout(local_size_x = 64) in;

layout(std140, binding = BLOCK_FRAME) uniform FrameBlock { Frame frame; };

layout(std430, binding = 0) readonly buffer Surfaces { vec4 surfaces[]; };
#ifdef HALFLIGHT_LIGHT_SAMPLES
layout(std430, binding = 1) readonly buffer Light { DirectLight light[]; };
layout(std430, binding = 2) readonly buffer Occluded { uint occluded[]; };
#endif
#ifdef HALFLIGHT_PATHS
layout(std430, binding = 3) readonly buffer States { PathState states[]; };
#endif
#ifdef HALFLIGHT_PENDING
layout(std430, binding = 4) readonly buffer LightOccluded { uint light_occluded[]; };
#endif

// Sums so far, in place.
layout(std430, binding = 5) buffer EmissionSums { double emission_sums[]; };  // rgb, coverage
#if defined(HALFLIGHT_LIGHT_SAMPLES) || defined(HALFLIGHT_PATHS)
#define HALFLIGHT_DIRECT
layout(std430, binding = 6) buffer DirectSums { double direct_sums[]; };  // diffuse rgb, glossy rgb
#endif
#ifdef HALFLIGHT_PENDING
layout(std430, binding = 7) buffer IndirectSums { double indirect_sums[]; };  // diffuse rgb, glossy rgb
#endif
#ifdef HALFLIGHT_SQUARES
layout(std430, binding = 8) buffer SquareSums { double square_sums[]; };
#endif
#ifdef HALFLIGHT_FEATURES
layout(std430, binding = 9) buffer FeatureSums { double feature_sums[]; };  // albedo, normal
#endif
layout(std430, binding = 10) buffer Counts { uint non_finite[kCountedPasses]; };

#include "shaders/lib/occlusion.glsl"
#include "shaders/lib/surface_record.glsl"

// Whatever an earlier frame has left there.
double so_far(double sum) { return frame.sample_index == 0u ? 0.0lf : sum; }
#define ADD(sum, value) sum = so_far(sum) + double(value)

vec3 guarded(vec3 v, uint pass) {
    bvec3 good = bvec3(finite(v.x), finite(v.y), finite(v.z));
    uint bad = 3u - uint(good.x) - uint(good.y) - uint(good.z);
    if (bad > 0u) atomicAdd(non_finite[pass], bad);
    return vec3(good.x ? v.x : 0.0, good.y ? v.y : 0.0, good.z ? v.z : 0.0);
}

void main() {
    uint path = gl_GlobalInvocationID.x;
    SurfacePoint point = load_surface_point(path);
    vec3 emission = guarded(point.emission, kCountGBuffer);
    dvec3 beauty = emission;  // of finite floats no sum of doubles overflows
    for (uint i = 0u; i < 3u; ++i) ADD(emission_sums[path * 4u + i], emission[i]);
    ADD(emission_sums[path * 4u + 3u], point.is_surface ? 1.0 : 0.0);

#ifdef HALFLIGHT_DIRECT
    dvec3 diffuse = dvec3(0.0);
    dvec3 glossy = dvec3(0.0);
#ifdef HALFLIGHT_LIGHT_SAMPLES
    if (point.is_surface) {
        diffuse = guarded(answered_light(light[path].diffuse, occluded[path]), kCountShadow);
        glossy = guarded(answered_light(light[path].glossy, occluded[path]), kCountShadow);
    }
#endif
#ifdef HALFLIGHT_PATHS
    uint lobe = states[path].lobe;
    vec3 met = lobe == kLobeNone ? vec3(0.0) : guarded(states[path].direct, kCountScatter);
    diffuse += dvec3(lobe == kLobeDiffuse ? met : vec3(0.0));
    glossy += dvec3(lobe == kLobeGlossy ? met : vec3(0.0));
#endif
    beauty += diffuse + glossy;
    for (uint i = 0u; i < 3u; ++i) {
        ADD(direct_sums[path * 6u + i], diffuse[i]);
        ADD(direct_sums[path * 6u + 3u + i], glossy[i]);
    }
#endif

#ifdef HALFLIGHT_PENDING
    vec3 later = vec3(0.0);
    if (lobe != kLobeNone) {
        later = states[path].indirect;
        if (states[path].pending_light != 0u) later += answered_light(states[path].pending, light_occluded[path]);
    }
    later = guarded(later, kCountContinuation);
    beauty += dvec3(later);
    for (uint i = 0u; i < 3u; ++i) {
        ADD(indirect_sums[path * 6u + i], lobe == kLobeDiffuse ? later[i] : 0.0);
        ADD(indirect_sums[path * 6u + 3u + i], lobe == kLobeGlossy ? later[i] : 0.0);
    }
#endif

#ifdef HALFLIGHT_FEATURES
    Bsdf b = load_bsdf(path);
    vec3 albedo = guarded(point.is_surface ? b.diffuse + b.transmission + b.specular : vec3(0.0), kCountGBuffer);
    vec3 normal = guarded(point.is_surface ? b.normal : vec3(0.0), kCountGBuffer);
    for (uint i = 0u; i < 3u; ++i) {
        ADD(feature_sums[path * 6u + i], albedo[i]);
        ADD(feature_sums[path * 6u + 3u + i], normal[i]);
    }
#endif

#ifdef HALFLIGHT_SQUARES
    for (uint i = 0u; i < 3u; ++i)
        ADD(square_sums[path * 3u + i], beauty[i] * beauty[i]);
#endif
}
