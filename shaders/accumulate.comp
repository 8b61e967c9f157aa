// Adds one sample to the sums of its pixel; the first sample of a picture begins them. NaNs, infinities and negative
// radiances are counted, by the pass that they come from, and taken as zero.
#include "shaders/shared/frame_block.h"
#include "shaders/shared/path_state.h"
#include "shaders/geometry_tables.glsl"  // tables of triangle lights
#include "shaders/scene_tables.glsl"

layout(local_size_x = 64) in;

const bool kLightSamples = HALFLIGHT_LIGHT_SAMPLES != 0;  // lights were sampled for first surfaces
const bool kPaths = HALFLIGHT_PATHS != 0;                 // rays left first surfaces
const bool kIndirect = HALFLIGHT_INDIRECT != 0;           // paths went on behind the second surface
const bool kPending = HALFLIGHT_PENDING != 0;             // the last light samples of paths have not been added yet
const bool kReuse = HALFLIGHT_REUSE != 0;                 // paths received light from their groups
const bool kSeen = HALFLIGHT_SEEN != 0;                   // the mean emission of several camera rays takes the place of one
const bool kLampsSeen = HALFLIGHT_LAMPS_SEEN != 0;  // light of lamps is added to what one camera ray sees
const bool kFeatures = HALFLIGHT_FEATURES != 0;
const bool kHalves = HALFLIGHT_HALVES != 0;
const bool kClamp = HALFLIGHT_CLAMP != 0;

layout(std140) uniform FrameBlock { Frame frame; };
// Drivers need not have more than eight storage blocks, so other read-only inputs are texture buffers.
uniform samplerBuffer light;                // RGBA32F: DirectLight, two texels each
uniform usamplerBuffer occluded;            // R32UI: answers to shadow rays
uniform usamplerBuffer sun_occluded;        // R32UI: answers to sun rays
uniform usamplerBuffer light_occluded;      // R32UI: answers to the last shadow rays
uniform usamplerBuffer later_sun_occluded;  // R32UI: answers to the last sun rays
uniform samplerBuffer sun_light;            // RGBA32F: radiance of sun samples
uniform samplerBuffer chains;               // RGBA32F: SpecularChain, three texels each
uniform samplerBuffer received;             // RGBA32F: DirectLight, two texels each
uniform samplerBuffer light_seen;           // RGBA32F: emission seen by camera rays, or light of lamps
uniform samplerBuffer group_light;          // RGBA32F: kGroupRows rows for each path
uniform float most_luminance;               // highest luminance of a sample's indirect light

// Sums of all samples so far; they are updated in place.
layout(std430) buffer EmissionSums { double emission_sums[]; };  // rgb, coverage
OPTIONAL(HALFLIGHT_LIGHT_SAMPLES || HALFLIGHT_PATHS)
    layout(std430) buffer DirectSums { double direct_sums[]; };  // diffuse rgb, glossy rgb
OPTIONAL(HALFLIGHT_INDIRECT) layout(std430) buffer IndirectSums { double indirect_sums[]; };  // diffuse rgb, glossy rgb
OPTIONAL(HALFLIGHT_SQUARES) layout(std430) buffer SquareSums { double square_sums[]; };
OPTIONAL(HALFLIGHT_FEATURES) layout(std430) buffer FeatureSums { double feature_sums[]; };  // albedo, normal
OPTIONAL(HALFLIGHT_HALVES) layout(std430) buffer HalfSums { double half_sums[]; };  // Accumulated::halves
OPTIONAL(HALFLIGHT_LIGHT_GROUPS) layout(std430) buffer GroupSums { double group_sums[]; };  // rgb of each light group
layout(std430) buffer Counts { uint bad_values[kCountedPasses * kBadKinds]; };

#include "shaders/lib/camera.glsl"
#include "shaders/lib/group_rows.glsl"
#include "shaders/lib/guarded_sums.glsl"
#include "shaders/lib/half_sums.glsl"
#include "shaders/lib/hit_texels.glsl"
#include "shaders/lib/light_of_hit.glsl"
#include "shaders/lib/luminance.glsl"
#include "shaders/lib/occlusion.glsl"
#include "shaders/lib/path_pixel.glsl"
#include "shaders/lib/state_texels.glsl"
#include "shaders/lib/sun_light.glsl"
#include "shaders/lib/surface_record.glsl"

// Light of a sample by the component of the first surface.
struct Components {
    dvec3 diffuse;
    dvec3 glossy;
};

// A path, if its light goes, and what it has met.
struct Sample {
    uint path;
    uint to;           // index of the sums
    SurfacePoint point;
    PathState state;   // kPaths
    uvec2 groups;      // groups of the light that the first ray met, and of the last light sample
};

// Adds light to a group of a pixel.
void add_to_group(uint to, uint group, dvec3 light) {
    uint first = (to * kLightGroups + group) * 3u;
    for (uint i = 0u; i < 3u; ++i) group_sums[first + i] += light[i];
}

// Returns a group's part of light, without the components that guarded() has taken out of the whole.
dvec3 part_of(vec3 part, vec3 whole) {
    bvec3 bad = greaterThanEqual(floatBitsToUint(whole) & 0x7fffffffu, uvec3(0x7f800000u));
    return dvec3(max(mix(part, vec3(0.0), bad), vec3(0.0)));
}

// Begins the sums of groups, and adds the emission that is seen, whose sum over the groups is point.emission.
void add_emission_to_groups(Sample s, int seen_row, vec3 of_surface) {
    for (uint i = 0u; i < (frame.begins != 0u ? 3u * kLightGroups : 0u); ++i)
        group_sums[s.to * 3u * kLightGroups + i] = 0.0lf;
    if (kSeen || kLampsSeen) {
        for (uint g = 0u; g < kLightGroups; ++g)
            add_to_group(s.to, g, part_of(texelFetch(light_seen, seen_row + 1 + int(g)).rgb, s.point.emission));
    }
    if (!kSeen) {
        Hit seen = load_hit(s.path);
        seen.triangle = s.point.is_surface ? seen.triangle : 0u;  // a miss looks up triangle 0, unused
        seen.instance = s.point.is_surface ? seen.instance : 0u;
        add_to_group(s.to, group_of_met(seen, s.point.is_surface), part_of(of_surface, s.point.emission));
    }
}

// Adds the direct light of a light sample, given the answer to its shadow ray.
void add_light_sample(int ray, uint answer, uint to, inout Components sum) {
    vec4 of_diffuse = texelFetch(light, 2 * ray);
    dvec3 by_diffuse = dvec3(guarded(answered_light(of_diffuse.rgb, answer), kCountShadow));
    dvec3 by_glossy = dvec3(guarded(answered_light(texelFetch(light, 2 * ray + 1).rgb, answer), kCountShadow));
    sum.diffuse += by_diffuse;
    sum.glossy += by_glossy;
    if (kLightGroups > 0u) add_to_group(to, word_of_float(of_diffuse.w), by_diffuse + by_glossy);
}

// Returns the light that light samples of the first surface and the ray that leaves it have found.
Components direct_light(Sample s) {
    Components sum = Components(dvec3(0.0), dvec3(0.0));
    if (kLightSamples && s.point.is_surface) {
        uint paths = gl_NumWorkGroups.x * 64u;
        for (uint i = 0u; i < HALFLIGHT_SHADOW_RAYS; ++i) {
            uint ray = i * paths + s.path;
            add_light_sample(int(ray), texelFetch(occluded, int(ray)).x, s.to, sum);
        }
        uint sun = HALFLIGHT_SHADOW_RAYS * paths + s.path;
        if (kSun) add_light_sample(int(sun), texelFetch(sun_occluded, int(s.path)).x, s.to, sum);
    }
    if (kPaths) {
        uint lobe = s.state.lobe;
        vec3 met = lobe == kLobeNone ? vec3(0.0) : guarded(s.state.direct, kCountScatter);
        sum.diffuse += dvec3(lobe == kLobeDiffuse ? met : vec3(0.0));
        sum.glossy += dvec3(lobe == kLobeGlossy ? met : vec3(0.0));
        if (kLightGroups > 0u) add_to_group(s.to, min(s.groups.x, kLightGroups - 1u), dvec3(met));
    }
    return sum;
}

// Returns the light of all later vertices, with that of the last light samples, and of the path's group.
Components indirect_light(Sample s) {
    uint lobe = s.state.lobe;
    vec3 later = vec3(0.0);
    vec3 sampled = vec3(0.0);  // light of the last samples: of a chosen light, and of the sun
    vec3 of_sun = vec3(0.0);
    if (lobe != kLobeNone) {
        later = s.state.indirect;
        if (kPending && s.state.pending_light != 0u) {
            sampled = answered_light(s.state.pending, texelFetch(light_occluded, int(s.path)).x);
            later += sampled;
            if (kSun) {
                of_sun = answered_light(texelFetch(sun_light, int(own_sun_light(s.path))).rgb,
                                        texelFetch(later_sun_occluded, int(s.path)).x);
                later += of_sun;
            }
        }
    }
    vec3 all_later = later;
    later = guarded(later, kCountContinuation);
    Components sum = Components(dvec3(lobe == kLobeDiffuse ? later : vec3(0.0)),
                                dvec3(lobe == kLobeGlossy ? later : vec3(0.0)));
    vec3 from_group_diffuse = vec3(0.0), from_group_glossy = vec3(0.0);
    if (kReuse) {
        from_group_diffuse = texelFetch(received, 2 * int(s.path)).rgb;
        from_group_glossy = texelFetch(received, 2 * int(s.path) + 1).rgb;
        sum.diffuse += dvec3(guarded(from_group_diffuse, kCountReuse));
        sum.glossy += dvec3(guarded(from_group_glossy, kCountReuse));
    }
    double kept = 1.0lf;
    if (kClamp) {
        double luminance = dot(sum.diffuse + sum.glossy, dvec3(kToLuminance));
        kept = luminance > most_luminance ? most_luminance / luminance : 1.0lf;
        sum.diffuse *= kept;
        sum.glossy *= kept;
    }
    if (kLightGroups > 0u) {  // drivers may keep samplers of a loop without steps
        for (uint g = 0u; g < kLightGroups; ++g) {
            vec3 own = vec3(0.0);
            if (lobe != kLobeNone) own = texelFetch(group_light, int(s.path * kGroupRows + kOwnGroups + g)).rgb;
            own += g == s.groups.y ? sampled : vec3(0.0);
            if (kSun) own += g == sun_group() ? of_sun : vec3(0.0);
            dvec3 part = part_of(own, all_later);
            if (kReuse) {
                int from = 2 * int(s.path + (1u + g) * gl_NumWorkGroups.x * 64u);
                part += part_of(texelFetch(received, from).rgb, from_group_diffuse);
                part += part_of(texelFetch(received, from + 1).rgb, from_group_glossy);
            }
            add_to_group(s.to, g, kept * part);
        }
    }
    return sum;
}

// Adds the sample to the sums of one half of the samples, for the denoiser. wo, albedo and normal: kFeatures.
void add_to_half(Sample s, Bsdf b, Components direct, Components indirect, vec3 wo, vec3 albedo, vec3 normal) {
    if (kIndirect) direct.glossy += indirect.glossy;
    double counts = frame_of_path(frame, s.path).first_half != 0u ? 1.0lf : 0.0lf;
    vec3 diffuse_albedo = guarded(s.point.is_surface ? b.diffuse + b.diffuse_through : vec3(0.0), kCountGBuffer);
    uint first = s.to * kHalfStride;
    for (uint i = 0u; i < 3u; ++i) {
        ADD(half_sums[first + i], counts * direct.diffuse[i]);
        ADD(half_sums[first + 3u + i], counts * indirect.diffuse[i]);
        ADD(half_sums[first + 6u + i], counts * direct.glossy[i]);
        ADD(half_sums[first + 9u + i], diffuse_albedo[i]);
    }
    float depth = camera_depth(frame, s.path, seen_position(s.path, s.point));
    ADD(half_sums[first + 12u], s.point.is_surface ? log(max(depth, kLeastDepth)) : 0.0);
    if (HALFLIGHT_SPECULAR_CHAINS != 0) {
        vec4 of_throughput = texelFetch(chains, 3 * int(s.path));
        vec4 of_albedo = texelFetch(chains, 3 * int(s.path) + 1);
        vec4 of_normal = texelFetch(chains, 3 * int(s.path) + 2);
        bool follows = s.point.is_surface && of_throughput.w > 0.0;
        float unfolded = depth + of_albedo.w * depth_per_distance(frame, -wo);  // depth at which the end appears
        float behind = log(max(unfolded, kLeastDepth) / max(depth, kLeastDepth)) + of_normal.w * kEscapedDepth;
        vec3 instead = follows ? of_albedo.rgb - (albedo - diffuse_albedo) : vec3(0.0);
        instead = guarded(instead, -kLargestFloat, kCountGBuffer);
        vec3 turned = guarded(follows ? of_normal.xyz - normal : vec3(0.0), -kLargestFloat, kCountGBuffer);
        vec3 rest = guarded(follows ? vec3(behind, of_throughput.w, 0.0) : vec3(0.0), -kLargestFloat, kCountGBuffer);
        for (uint i = 0u; i < 3u; ++i) {
            ADD(half_sums[first + kHalfSums + i], instead[i]);
            ADD(half_sums[first + kHalfSums + 3u + i], turned[i]);
            if (i < 2u) ADD(half_sums[first + kHalfSums + 6u + i], rest[i]);
        }
    }
}

// Adds the sample of a path to the sums at index `to`.
void add(uint path, uint to) {
    Sample s;
    s.path = path;
    s.to = to;
    s.point = load_surface_point(path);
    int seen_row = int(path * (1u + kLightGroups));
    vec3 seen = vec3(0.0);
    if (kSeen || kLampsSeen) seen = texelFetch(light_seen, seen_row).rgb;
    vec3 of_surface = s.point.emission;
    if (kSeen) s.point.emission = seen;
    if (kLampsSeen) s.point.emission += seen;
    vec3 emission = guarded(s.point.emission, kCountGBuffer);
    dvec3 beauty = emission;  // no sum of doubles overflows for finite floats
    for (uint i = 0u; i < 3u; ++i) ADD(emission_sums[to * 4u + i], emission[i]);
    ADD(emission_sums[to * 4u + 3u], s.point.is_surface ? 1.0 : 0.0);
    if (kLightGroups > 0u) add_emission_to_groups(s, seen_row, of_surface);

    Components direct = Components(dvec3(0.0), dvec3(0.0)), indirect = direct;
    if (kPaths) s.state = load_state(path);
    s.groups = uvec2(0u);
    if (kPaths && kLightGroups > 0u && s.state.lobe != kLobeNone)
        s.groups = words_of_floats(texelFetch(group_light, int(path * kGroupRows))).xy;
    if (kLightSamples || kPaths) {
        direct = direct_light(s);
        beauty += direct.diffuse + direct.glossy;
        for (uint i = 0u; i < 3u; ++i) {
            ADD(direct_sums[to * 6u + i], direct.diffuse[i]);
            ADD(direct_sums[to * 6u + 3u + i], direct.glossy[i]);
        }
    }
    if (kIndirect) {
        indirect = indirect_light(s);
        beauty += indirect.diffuse + indirect.glossy;
        for (uint i = 0u; i < 3u; ++i) {
            ADD(indirect_sums[to * 6u + i], indirect.diffuse[i]);
            ADD(indirect_sums[to * 6u + 3u + i], indirect.glossy[i]);
        }
    }

    Bsdf b = load_bsdf(path);
    vec3 wo = vec3(0.0), albedo = vec3(0.0), normal = vec3(0.0);
    if (kFeatures) {
        wo = -camera_direction(frame, path, seen_position(path, s.point));
        albedo = guarded(s.point.is_surface ? reflectance(b, wo) : vec3(0.0), kCountGBuffer);
        // Samples of one colour channel have three times its light, and the albedo of the mean sample.
        albedo = b.disperses ? albedo : min(albedo, vec3(1.0));
        normal = guarded(s.point.is_surface ? b.normal : vec3(0.0), -kLargestFloat, kCountGBuffer);
        for (uint i = 0u; i < 3u; ++i) {
            ADD(feature_sums[to * 6u + i], albedo[i]);
            ADD(feature_sums[to * 6u + 3u + i], normal[i]);
        }
    }
    if (kHalves) add_to_half(s, b, direct, indirect, wo, albedo, normal);
    if (HALFLIGHT_SQUARES != 0)
        for (uint i = 0u; i < 3u; ++i) ADD(square_sums[to * 3u + i], beauty[i] * beauty[i]);
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
