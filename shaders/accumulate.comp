// Adds one sample to the sums of its pixel. No NaN or infinity gets into them: such values are counted, by the pass they come
// from, and taken as zero.
#include "shaders/shared/path.h"
#include "shaders/scene_tables.glsl"

layout(local_size_x = 64) in;

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

layout(std430, binding = 5) readonly buffer EmissionBefore { double emission_before[]; };  // rgb, coverage
layout(std430, binding = 6) writeonly buffer EmissionNow { double emission_now[]; };
#if defined(HALFLIGHT_LIGHT_SAMPLES) || defined(HALFLIGHT_PATHS)
#define HALFLIGHT_DIRECT
layout(std430, binding = 7) readonly buffer DirectBefore { double direct_before[]; };  // diffuse rgb, glossy rgb
layout(std430, binding = 8) writeonly buffer DirectNow { double direct_now[]; };
#endif
#ifdef HALFLIGHT_PENDING
layout(std430, binding = 9) readonly buffer IndirectBefore { double indirect_before[]; };  // diffuse rgb, glossy rgb
layout(std430, binding = 10) writeonly buffer IndirectNow { double indirect_now[]; };
#endif
#ifdef HALFLIGHT_SQUARES
layout(std430, binding = 11) readonly buffer SquaresBefore { double squares_before[]; };
layout(std430, binding = 12) writeonly buffer SquaresNow { double squares_now[]; };
#endif
#ifdef HALFLIGHT_FEATURES
layout(std430, binding = 14) readonly buffer FeaturesBefore { double features_before[]; };  // albedo, normal
layout(std430, binding = 15) writeonly buffer FeaturesNow { double features_now[]; };
#endif
layout(std430, binding = 13) buffer Counts { uint non_finite[kCountedPasses]; };

#include "shaders/lib/surface_record.glsl"

// Bits decide: a compiler may take isnan() of arithmetic for always false.
bool finite(float v) { return (floatBitsToUint(v) & 0x7f800000u) != 0x7f800000u; }

vec3 guarded(vec3 v, uint pass) {
    bvec3 good = bvec3(finite(v.x), finite(v.y), finite(v.z));
    uint bad = 3u - uint(good.x) - uint(good.y) - uint(good.z);
    while (bad > 0u) {  // a loop without rounds costs nothing, an untaken branch may
        atomicAdd(non_finite[pass], bad);
        bad = 0u;
    }
    return vec3(good.x ? v.x : 0.0, good.y ? v.y : 0.0, good.z ? v.z : 0.0);
}

void main() {
    uint path = gl_GlobalInvocationID.x;
    SurfacePoint point = load_surface_point(path);
    vec3 emission = guarded(point.emission, kCountGBuffer);
    dvec3 beauty = emission;  // of finite floats no sum of doubles overflows
    for (uint i = 0u; i < 3u; ++i) emission_now[path * 4u + i] = emission_before[path * 4u + i] + double(emission[i]);
    emission_now[path * 4u + 3u] = emission_before[path * 4u + 3u] + double(point.is_surface ? 1.0 : 0.0);

#ifdef HALFLIGHT_DIRECT
    dvec3 diffuse = dvec3(0.0);
    dvec3 glossy = dvec3(0.0);
#ifdef HALFLIGHT_LIGHT_SAMPLES
    if (point.is_surface && occluded[path] == 0u) {
        diffuse = guarded(light[path].diffuse, kCountShadow);
        glossy = guarded(light[path].glossy, kCountShadow);
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
        direct_now[path * 6u + i] = direct_before[path * 6u + i] + diffuse[i];
        direct_now[path * 6u + 3u + i] = direct_before[path * 6u + 3u + i] + glossy[i];
    }
#endif

#ifdef HALFLIGHT_PENDING
    vec3 later = vec3(0.0);
    if (lobe != kLobeNone) {
        later = states[path].indirect;
        if (states[path].pending_light != 0u && light_occluded[path] == 0u) later += states[path].pending;
    }
    later = guarded(later, kCountContinuation);
    beauty += dvec3(later);
    for (uint i = 0u; i < 3u; ++i) {
        indirect_now[path * 6u + i] = indirect_before[path * 6u + i] + double(lobe == kLobeDiffuse ? later[i] : 0.0);
        indirect_now[path * 6u + 3u + i] =
            indirect_before[path * 6u + 3u + i] + double(lobe == kLobeGlossy ? later[i] : 0.0);
    }
#endif

#ifdef HALFLIGHT_FEATURES
    Bsdf b = load_bsdf(path);
    vec3 albedo = guarded(point.is_surface ? b.diffuse + b.transmission + b.specular : vec3(0.0), kCountGBuffer);
    vec3 normal = guarded(point.is_surface ? b.normal : vec3(0.0), kCountGBuffer);
    for (uint i = 0u; i < 3u; ++i) {
        features_now[path * 6u + i] = features_before[path * 6u + i] + double(albedo[i]);
        features_now[path * 6u + 3u + i] = features_before[path * 6u + 3u + i] + double(normal[i]);
    }
#endif

#ifdef HALFLIGHT_SQUARES
    for (uint i = 0u; i < 3u; ++i)
        squares_now[path * 3u + i] = squares_before[path * 3u + i] + beauty[i] * beauty[i];
#endif
}
