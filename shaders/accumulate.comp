// Adds one sample to the sums of its pixel; the first sample of a picture begins them. NaNs, infinities and negative
// radiances are counted, by the pass that they come from, and taken as zero.
#include "shaders/shared/frame_block.h"
#include "shaders/shared/path_state.h"
#if HALFLIGHT_LIGHT_GROUPS
#include "shaders/geometry_tables.glsl"  // tables of triangle lights
#endif
#include "shaders/scene_tables.glsl"

layout(local_size_x = 64) in;

layout(std140) uniform FrameBlock { Frame frame; };

// Drivers need not have more than eight storage blocks, so other read-only inputs are texture buffers.
#if HALFLIGHT_LIGHT_SAMPLES
uniform samplerBuffer light;      // RGBA32F: DirectLight, two texels each
uniform usamplerBuffer occluded;  // R32UI: answers to shadow rays
#if HALFLIGHT_SUN
uniform usamplerBuffer sun_occluded;  // R32UI: answers to sun rays
#endif
#endif
#if HALFLIGHT_PATHS
#include "shaders/lib/state_texels.glsl"
#endif
#if HALFLIGHT_PENDING
uniform usamplerBuffer light_occluded;  // R32UI: answers to the last shadow rays
#if HALFLIGHT_SUN
uniform usamplerBuffer later_sun_occluded;  // R32UI: answers to the last sun rays
uniform samplerBuffer sun_light;            // RGBA32F: radiance of sun samples
#endif
#endif

// Sums of all samples so far; they are updated in place.
layout(std430) buffer EmissionSums { double emission_sums[]; };  // rgb, coverage
#define HALFLIGHT_DIRECT (HALFLIGHT_LIGHT_SAMPLES || HALFLIGHT_PATHS)
#if HALFLIGHT_DIRECT
layout(std430) buffer DirectSums { double direct_sums[]; };  // diffuse rgb, glossy rgb
#endif
#if HALFLIGHT_INDIRECT
layout(std430) buffer IndirectSums { double indirect_sums[]; };  // diffuse rgb, glossy rgb
#endif
#if HALFLIGHT_SQUARES
layout(std430) buffer SquareSums { double square_sums[]; };
#endif
#if HALFLIGHT_FEATURES
layout(std430) buffer FeatureSums { double feature_sums[]; };  // albedo, normal
#endif
#if HALFLIGHT_HALVES
layout(std430) buffer HalfSums { double half_sums[]; };  // Accumulated::halves
#endif
#if HALFLIGHT_LIGHT_GROUPS
layout(std430) buffer GroupSums { double group_sums[]; };  // rgb of each light group
#endif
layout(std430) buffer Counts { uint bad_values[kCountedPasses * kBadKinds]; };
#if HALFLIGHT_SPECULAR_CHAINS
uniform samplerBuffer chains;  // RGBA32F: SpecularChain, three texels each
#endif
#if HALFLIGHT_REUSE
uniform samplerBuffer received;  // RGBA32F: DirectLight, two texels each
#endif

#if HALFLIGHT_SEEN
uniform samplerBuffer light_seen;  // RGBA32F: emission seen by camera rays
#endif

#if HALFLIGHT_LIGHT_GROUPS
#include "shaders/lib/hit_texels.glsl"
#if HALFLIGHT_PATHS
uniform samplerBuffer group_light;  // RGBA32F: kGroupRows rows for each path
#endif
#endif

#if HALFLIGHT_CLAMP
uniform float most_luminance;  // highest luminance of a sample's indirect light
#endif

#include "shaders/lib/camera.glsl"
#include "shaders/lib/guarded_sums.glsl"
#include "shaders/lib/half_sums.glsl"
#include "shaders/lib/luminance.glsl"
#include "shaders/lib/occlusion.glsl"
#include "shaders/lib/path_pixel.glsl"
#include "shaders/lib/sun_light.glsl"
#include "shaders/lib/surface_record.glsl"
#if HALFLIGHT_LIGHT_GROUPS
#include "shaders/lib/group_rows.glsl"
#include "shaders/lib/light_of_hit.glsl"
#endif

#if HALFLIGHT_LIGHT_GROUPS
// Adds light to a group of a pixel.
void add_to_group(uint to, uint group, dvec3 light) {
    uint first = (to * HALFLIGHT_LIGHT_GROUPS + group) * 3u;
    for (uint i = 0u; i < 3u; ++i) group_sums[first + i] += light[i];
}

// Returns a group's part of light, without the components that guarded() has taken out of the whole.
dvec3 part_of(vec3 part, vec3 whole) {
    bvec3 bad = greaterThanEqual(floatBitsToUint(whole) & 0x7fffffffu, uvec3(0x7f800000u));
    return dvec3(max(mix(part, vec3(0.0), bad), vec3(0.0)));
}
#endif

#if HALFLIGHT_LIGHT_SAMPLES
// Adds the direct light of a sample, given the answer to its shadow ray.
void add_sample(int ray, uint answer, uint to, inout dvec3 diffuse, inout dvec3 glossy) {
    vec4 of_diffuse = texelFetch(light, 2 * ray);
    dvec3 by_diffuse = dvec3(guarded(answered_light(of_diffuse.rgb, answer), kCountShadow));
    dvec3 by_glossy = dvec3(guarded(answered_light(texelFetch(light, 2 * ray + 1).rgb, answer), kCountShadow));
    diffuse += by_diffuse;
    glossy += by_glossy;
#if HALFLIGHT_LIGHT_GROUPS
    add_to_group(to, word_of_float(of_diffuse.w), by_diffuse + by_glossy);
#endif
}
#endif

// Adds the sample of a path to the sums at index `to`.
void add(uint path, uint to) {
    SurfacePoint point = load_surface_point(path);
#if HALFLIGHT_SEEN
#if HALFLIGHT_LIGHT_GROUPS
    uint seen_row = path * (1u + HALFLIGHT_LIGHT_GROUPS);
#else
    uint seen_row = path;
#endif
    point.emission = texelFetch(light_seen, int(seen_row)).rgb;
#endif
    vec3 emission = guarded(point.emission, kCountGBuffer);
    dvec3 beauty = emission;  // no sum of doubles overflows for finite floats
    for (uint i = 0u; i < 3u; ++i) ADD(emission_sums[to * 4u + i], emission[i]);
    ADD(emission_sums[to * 4u + 3u], point.is_surface ? 1.0 : 0.0);
#if HALFLIGHT_LIGHT_GROUPS
    for (uint i = 0u; i < (frame.begins != 0u ? 3u * HALFLIGHT_LIGHT_GROUPS : 0u); ++i)
        group_sums[to * 3u * HALFLIGHT_LIGHT_GROUPS + i] = 0.0lf;
#if HALFLIGHT_SEEN
    for (uint g = 0u; g < HALFLIGHT_LIGHT_GROUPS; ++g)
        add_to_group(to, g, part_of(texelFetch(light_seen, int(seen_row + 1u + g)).rgb, point.emission));
#else
    Hit seen = load_hit(path);
    seen.triangle = point.is_surface ? seen.triangle : 0u;  // a miss looks up triangle 0 in vain
    seen.instance = point.is_surface ? seen.instance : 0u;
    add_to_group(to, group_of_met(seen, point.is_surface), dvec3(emission));
#endif
#endif

#if HALFLIGHT_DIRECT
    dvec3 diffuse = dvec3(0.0);
    dvec3 glossy = dvec3(0.0);
#if HALFLIGHT_LIGHT_SAMPLES
    if (point.is_surface) {
        uint paths = gl_NumWorkGroups.x * 64u;
        for (uint i = 0u; i < HALFLIGHT_SHADOW_RAYS; ++i) {
            uint ray = i * paths + path;
            add_sample(int(ray), texelFetch(occluded, int(ray)).x, to, diffuse, glossy);
        }
#if HALFLIGHT_SUN
        uint sun = HALFLIGHT_SHADOW_RAYS * paths + path;
        add_sample(int(sun), texelFetch(sun_occluded, int(path)).x, to, diffuse, glossy);
#endif
    }
#endif
#if HALFLIGHT_PATHS
    PathState state = load_state(path);
    uint lobe = state.lobe;
    vec3 met = lobe == kLobeNone ? vec3(0.0) : guarded(state.direct, kCountScatter);
    diffuse += dvec3(lobe == kLobeDiffuse ? met : vec3(0.0));
    glossy += dvec3(lobe == kLobeGlossy ? met : vec3(0.0));
#if HALFLIGHT_LIGHT_GROUPS
    int group_row = int(path * kGroupRows);
    uvec2 last_groups = uvec2(0u);  // groups of the light that the first ray met, and of the last light sample
    if (lobe != kLobeNone) last_groups = words_of_floats(texelFetch(group_light, group_row)).xy;
    add_to_group(to, min(last_groups.x, HALFLIGHT_LIGHT_GROUPS - 1u), dvec3(met));
#endif
#endif
    beauty += diffuse + glossy;
    for (uint i = 0u; i < 3u; ++i) {
        ADD(direct_sums[to * 6u + i], diffuse[i]);
        ADD(direct_sums[to * 6u + 3u + i], glossy[i]);
    }
#endif

#if HALFLIGHT_INDIRECT
    vec3 later = vec3(0.0);
    vec3 sampled = vec3(0.0);  // light of the last samples: of a light, of the sun
    vec3 of_sun = vec3(0.0);
    if (lobe != kLobeNone) {
        later = state.indirect;
#if HALFLIGHT_PENDING
        if (state.pending_light != 0u) {
            sampled = answered_light(state.pending, texelFetch(light_occluded, int(path)).x);
            later += sampled;
#if HALFLIGHT_SUN
            of_sun = answered_light(texelFetch(sun_light, int(own_sun_light(path))).rgb,
                                    texelFetch(later_sun_occluded, int(path)).x);
            later += of_sun;
#endif
        }
#endif
    }
    vec3 all_later = later;
    later = guarded(later, kCountContinuation);
    dvec3 later_diffuse = dvec3(lobe == kLobeDiffuse ? later : vec3(0.0));
    dvec3 later_glossy = dvec3(lobe == kLobeGlossy ? later : vec3(0.0));
#if HALFLIGHT_REUSE
    vec3 from_group_diffuse = texelFetch(received, 2 * int(path)).rgb;
    vec3 from_group_glossy = texelFetch(received, 2 * int(path) + 1).rgb;
    later_diffuse += dvec3(guarded(from_group_diffuse, kCountReuse));
    later_glossy += dvec3(guarded(from_group_glossy, kCountReuse));
#endif
    double kept = 1.0lf;
#if HALFLIGHT_CLAMP
    double luminance = dot(later_diffuse + later_glossy, dvec3(kToLuminance));
    kept = luminance > most_luminance ? most_luminance / luminance : 1.0lf;
    later_diffuse *= kept;
    later_glossy *= kept;
#endif
#if HALFLIGHT_LIGHT_GROUPS
    for (uint g = 0u; g < HALFLIGHT_LIGHT_GROUPS; ++g) {
        vec3 own = vec3(0.0);
        if (lobe != kLobeNone) own = texelFetch(group_light, group_row + int(kOwnGroups + g)).rgb;
        own += g == last_groups.y ? sampled : vec3(0.0);
#if HALFLIGHT_SUN
        own += g == sun_group() ? of_sun : vec3(0.0);
#endif
        dvec3 part = part_of(own, all_later);
#if HALFLIGHT_REUSE
        int from = 2 * int(path + (1u + g) * gl_NumWorkGroups.x * 64u);
        part += part_of(texelFetch(received, from).rgb, from_group_diffuse);
        part += part_of(texelFetch(received, from + 1).rgb, from_group_glossy);
#endif
        add_to_group(to, g, kept * part);
    }
#endif
    beauty += later_diffuse + later_glossy;
    for (uint i = 0u; i < 3u; ++i) {
        ADD(indirect_sums[to * 6u + i], later_diffuse[i]);
        ADD(indirect_sums[to * 6u + 3u + i], later_glossy[i]);
    }
#endif

#if HALFLIGHT_FEATURES || HALFLIGHT_HALVES
    Bsdf b = load_bsdf(path);
#endif
#if HALFLIGHT_FEATURES
    vec3 wo = -camera_direction(frame, path, seen_position(path, point));
    vec3 albedo = guarded(point.is_surface ? reflectance(b, wo) : vec3(0.0), kCountGBuffer);
    // Samples of one colour channel have three times its light, and the albedo of the mean sample.
    albedo = b.disperses ? albedo : min(albedo, vec3(1.0));
    vec3 normal = guarded(point.is_surface ? b.normal : vec3(0.0), -kLargestFloat, kCountGBuffer);
    for (uint i = 0u; i < 3u; ++i) {
        ADD(feature_sums[to * 6u + i], albedo[i]);
        ADD(feature_sums[to * 6u + 3u + i], normal[i]);
    }
#endif

#if HALFLIGHT_HALVES
#if !HALFLIGHT_DIRECT
    dvec3 diffuse = dvec3(0.0);
    dvec3 glossy = dvec3(0.0);
#endif
#if HALFLIGHT_INDIRECT
    glossy += later_glossy;
#else
    dvec3 later_diffuse = dvec3(0.0);
#endif
    double counts = frame_of_path(frame, path).first_half != 0u ? 1.0lf : 0.0lf;
    vec3 diffuse_albedo = guarded(point.is_surface ? b.diffuse + b.diffuse_through : vec3(0.0), kCountGBuffer);
    uint first = to * kHalfStride;
    for (uint i = 0u; i < 3u; ++i) {
        ADD(half_sums[first + i], counts * diffuse[i]);
        ADD(half_sums[first + 3u + i], counts * later_diffuse[i]);
        ADD(half_sums[first + 6u + i], counts * glossy[i]);
        ADD(half_sums[first + 9u + i], diffuse_albedo[i]);
    }
    float depth = camera_depth(frame, path, seen_position(path, point));
    ADD(half_sums[first + 12u], point.is_surface ? log(max(depth, kLeastDepth)) : 0.0);
#if HALFLIGHT_SPECULAR_CHAINS
    vec4 of_throughput = texelFetch(chains, 3 * int(path));
    vec4 of_albedo = texelFetch(chains, 3 * int(path) + 1);
    vec4 of_normal = texelFetch(chains, 3 * int(path) + 2);
    bool follows = point.is_surface && of_throughput.w > 0.0;
    float unfolded = depth + of_albedo.w * depth_per_distance(frame, -wo);  // depth at which the end appears
    float behind = log(max(unfolded, kLeastDepth) / max(depth, kLeastDepth)) + of_normal.w * kEscapedDepth;
    vec3 instead = guarded(follows ? of_albedo.rgb - (albedo - diffuse_albedo) : vec3(0.0), -kLargestFloat, kCountGBuffer);
    vec3 turned = guarded(follows ? of_normal.xyz - normal : vec3(0.0), -kLargestFloat, kCountGBuffer);
    vec3 rest = guarded(follows ? vec3(behind, of_throughput.w, 0.0) : vec3(0.0), -kLargestFloat, kCountGBuffer);
    for (uint i = 0u; i < 3u; ++i) {
        ADD(half_sums[first + kHalfSums + i], instead[i]);
        ADD(half_sums[first + kHalfSums + 3u + i], turned[i]);
        if (i < 2u) ADD(half_sums[first + kHalfSums + 6u + i], rest[i]);
    }
#endif
#endif

#if HALFLIGHT_SQUARES
    for (uint i = 0u; i < 3u; ++i)
        ADD(square_sums[to * 3u + i], beauty[i] * beauty[i]);
#endif
}

void main() {
    uint path = gl_GlobalInvocationID.x;
#if HALFLIGHT_SAMPLED_BLOCKS
    // Entries of one block follow each other. The paths of the first entry add the samples of all.
    uint block = sampled_block(path).block;
    bool first = path < 256u || sampled_block(path - 256u).block != block;
    if (!first || block == kNoBlock) return;
    uint to = path_in_band(path);
    for (uint end = gl_NumWorkGroups.x * 64u; path < end && sampled_block(path).block == block; path += 256u)
        add(path, to);
#else
    add(path, path);
#endif
}
