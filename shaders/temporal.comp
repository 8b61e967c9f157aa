// Combines the light of the new picture with that of an earlier one at equal surface points (Schied et al. 2017,
// Spatiotemporal Variance-Guided Filtering, section 4.1). The earlier light is clipped to the likely range of the new
// picture's neighbourhood (Salvi 2016, An Excursion in Temporal Supersampling: variance clipping). HALFLIGHT_HISTORY:
// there is an earlier picture. HALFLIGHT_MOVED: surfaces may have been elsewhere in it.
#include "shaders/shared/preview.h"

layout(local_size_x = 8, local_size_y = 8) in;

// passes/preview/preview_texels.h describes the content of these textures.
uniform sampler2D light;
uniform sampler2D guide;
uniform sampler2D place;
#ifdef HALFLIGHT_HISTORY
uniform sampler2D earlier_light;
uniform sampler2D earlier_guide;
uniform sampler2D earlier_place;
layout(std430) buffer Refused { uint refused[kRefusedKinds]; };
uniform mat4 to_earlier;      // matrix from the earlier picture's origin to its clip space, y down
uniform vec3 origin_shift;    // vector from the earlier picture's origin to the new origin
uniform float earlier_pixel;  // height of a pixel of the earlier picture where its clip space's w is 1, world units
uniform float earlier_share;  // weight of the earlier samples, (0,1]
#ifdef HALFLIGHT_MOVED
uniform sampler2D before;  // xyz: earlier position of the surface, relative to the earlier picture's origin
#endif
#endif
layout(rgba32f) writeonly uniform image2D to_light;
layout(rgba32f) writeonly uniform image2D to_guide;
layout(rgba32f) writeonly uniform image2D to_place;

#include "shaders/lib/finite.glsl"

#ifdef HALFLIGHT_HISTORY
const float kSameNormal = 0.5;  // cosine; mapped normals differ between single samples
const float kSamePlane = 2.0;   // distance of a point from the other tangent plane, pixels of the earlier picture
const int kClipRadius = 3;      // pixels; with kClipDeviations, the likely range of the new light
const float kClipDeviations = 2.0;

bool nan(vec4 v) {
    return any(greaterThan(floatBitsToUint(v) & 0x7fffffffu, uvec4(0x7f800000u)));
}

struct Earlier {
    vec4 light;
    float samples;  // number of samples; 0: no earlier light
};

// Returns the earlier light. Each texel is tested, so that light of neighbouring surfaces is left out.
Earlier earlier_at(vec3 at, vec3 normal) {
    Earlier found = Earlier(vec4(0.0), 0.0);
    float sum = 0.0;
    vec4 clip = to_earlier * vec4(at, 1.0);
    ivec2 size = textureSize(earlier_light, 0);
    vec2 there = (clip.xy / clip.w * 0.5 + 0.5) * vec2(size) - 0.5;
    bool ahead = clip.w > 0.0 && all(greaterThan(there, vec2(-1.0))) && all(lessThan(there, vec2(size)));
    there = ahead ? there : vec2(-2.0);
    ivec2 corner = ivec2(floor(there));
    vec2 part = there - vec2(corner);
    for (int i = 0; i < 4; ++i) {
        ivec2 step = ivec2(i & 1, i >> 1);
        ivec2 texel = corner + step;
        bool inside = all(greaterThanEqual(texel, ivec2(0))) && all(lessThan(texel, size));
        texel = clamp(texel, ivec2(0), size - 1);
        vec4 l = texelFetch(earlier_light, texel, 0);
        vec4 g = texelFetch(earlier_guide, texel, 0);
        vec4 p = texelFetch(earlier_place, texel, 0);
        bool same = inside && g.w > 0.0 && dot(g.xyz, normal) > kSameNormal &&
                    abs(dot(normal, p.xyz - at)) < kSamePlane * earlier_pixel * clip.w;
        bool has_nan = nan(l) || nan(g) || nan(p);
        bool whole = !has_nan && all_finite(l.rgb) && all_finite(vec3(l.a, g.w, p.w)) && all_finite(g.xyz) &&
                     all_finite(p.xyz);
        // A loop without iterations costs nothing, unlike a branch not taken.
        for (int bad = 0; bad < (inside && !whole ? 1 : 0); ++bad)
            atomicAdd(refused[has_nan ? kRefusedNan : kRefusedInfinite], 1u);
        bool good = same && whole && l.a >= 0.0 && p.w > 0.0;
        vec2 side = mix(1.0 - part, part, vec2(step));
        float weight = good ? side.x * side.y : 0.0;
        sum += weight;
        found.light += good ? weight * l : vec4(0.0);
        found.samples += good ? weight * p.w : 0.0;
    }
    const float kLeast = 0.01;  // least sum of the four weights
    found.light /= max(sum, kLeast);
    found.samples = sum < kLeast ? 0.0 : found.samples / sum;
    return found;
}

vec3 clipped(vec3 earlier, ivec2 pixel) {
    ivec2 last = textureSize(light, 0) - 1;
    vec3 sum = vec3(0.0);
    vec3 squares = vec3(0.0);
    float count = 0.0;
    for (int y = -kClipRadius; y <= kClipRadius; ++y) {
        for (int x = -kClipRadius; x <= kClipRadius; ++x) {
            vec4 l = texelFetch(light, clamp(pixel + ivec2(x, y), ivec2(0), last), 0);
            float seen = l.a >= 0.0 ? 1.0 : 0.0;
            sum += l.rgb;  // 0 where no surface is visible
            squares += l.rgb * l.rgb;
            count += seen;
        }
    }
    vec3 mean = sum / max(count, 1.0);
    vec3 reach = kClipDeviations * sqrt(max(squares / max(count, 1.0) - mean * mean, vec3(0.0)));
    return clamp(earlier, mean - reach, mean + reach);
}
#endif

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(to_light)))) return;
    vec4 new_light = texelFetch(light, pixel, 0);
    vec4 new_guide = texelFetch(guide, pixel, 0);
    vec4 new_place = texelFetch(place, pixel, 0);
#ifdef HALFLIGHT_HISTORY
#ifdef HALFLIGHT_MOVED
    vec3 at = texelFetch(before, pixel, 0).xyz;
#else
    vec3 at = new_place.xyz + origin_shift;
#endif
    Earlier earlier = earlier_at(at, new_guide.xyz);
    earlier.light.rgb = clipped(earlier.light.rgb, pixel);
    float samples = new_place.w;
    float fading = clamp((kTemporalEnds - samples) / (kTemporalEnds - 1.0), 0.0, 1.0);
    float kept = new_light.a >= 0.0 ? fading * earlier_share * min(earlier.samples, kMostHistory) : 0.0;
    if (kept > 0.0) {
        new_light = mix(new_light, earlier.light, kept / (kept + samples));
        new_place.w += kept;
    }
#endif
    imageStore(to_light, pixel, new_light);
    imageStore(to_guide, pixel, new_guide);
    imageStore(to_place, pixel, new_place);
}
