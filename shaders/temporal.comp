// Combines the light of the new picture with that of an earlier one at equal surface points (Schied et al. 2017,
// Spatiotemporal Variance-Guided Filtering, section 4.1). The earlier light is clipped to the likely range of the new
// picture's neighbourhood (Salvi 2016, An Excursion in Temporal Supersampling: variance clipping). HALFLIGHT_HISTORY:
// there is an earlier picture. HALFLIGHT_MOVED: surfaces may have been elsewhere in it.
#include "shaders/shared/preview_constants.h"

layout(local_size_x = 8, local_size_y = 8) in;

// passes/preview/preview_texels.h describes the content of these textures.
uniform sampler2D first;
uniform sampler2D second;
uniform sampler2D guide;
uniform sampler2D place;
// These exist if there is an earlier picture:
uniform sampler2D earlier_first;
uniform sampler2D earlier_second;
uniform sampler2D earlier_guide;
uniform sampler2D earlier_place;
// atomicAdd() takes only variables of blocks or shared ones.
#if HALFLIGHT_HISTORY
layout(std430) buffer Refused { uint refused[kRefusedKinds]; };
#else
shared uint refused[kRefusedKinds];
#endif
uniform mat4 to_earlier;      // matrix from the earlier picture's origin to its clip space, y down
uniform vec3 origin_shift;    // vector from the earlier picture's origin to the new origin
uniform float earlier_pixel;  // height of a pixel of the earlier picture where its clip space's w is 1, world units
uniform float earlier_share;  // weight of the earlier samples, (0,1]
uniform sampler2D before;     // HALFLIGHT_MOVED: xyz: earlier position, relative to the earlier picture's origin
layout(rgba32f) writeonly uniform image2D to_first;
layout(rgba32f) writeonly uniform image2D to_second;
layout(rgba32f) writeonly uniform image2D to_guide;
layout(rgba32f) writeonly uniform image2D to_place;

#include "shaders/lib/finite.glsl"
#include "shaders/lib/halves.glsl"
#include "shaders/lib/preview_light.glsl"

const float kSameNormal = 0.5;  // cosine; mapped normals differ between single samples
const float kSamePlane = 2.0;   // distance of a point from the other tangent plane, pixels of the earlier picture
const int kClipRadius = 3;      // pixels; with kClipDeviations, the likely range of the new light
const float kClipDeviations = 2.0;

bool nan(vec4 v) {
    return any(greaterThan(floatBitsToUint(v) & 0x7fffffffu, uvec4(0x7f800000u)));
}

// Halves of earlier light; alpha: number of samples, 0: no earlier light.
struct Earlier {
    vec4 first;
    vec4 second;
};

// Returns light with its samples limited, times their number and a weight.
vec4 weighed(vec4 light, float weight) {
    float samples = clamp(light.a, 0.0, kMostHistory);
    return weight * vec4(samples * light.rgb, samples);
}
// Returns the light of a sum of weighed() light.
vec4 light_of_sum(vec4 sum, float weights) {
    return vec4(sum.rgb / max(sum.a, 1e-30), sum.a / weights);
}

// Returns the earlier light. Each texel is tested, so that light of neighbouring surfaces is left out.
Earlier earlier_at(vec3 at, vec3 normal) {
    Earlier found = Earlier(vec4(0.0), vec4(0.0));
    float sum = 0.0;
    vec4 clip = to_earlier * vec4(at, 1.0);
    ivec2 size = textureSize(earlier_first, 0);
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
        vec4 a = texelFetch(earlier_first, texel, 0);
        vec4 b = texelFetch(earlier_second, texel, 0);
        vec4 g = texelFetch(earlier_guide, texel, 0);
        vec4 p = texelFetch(earlier_place, texel, 0);
        // Means of normals are shorter than 1.
        bool same = inside && dot(g.xyz, normal) > kSameNormal * length(g.xyz) * length(normal) &&
                    abs(dot(normal, p.xyz - at)) < kSamePlane * earlier_pixel * clip.w * length(normal);
        bool has_nan = nan(a) || nan(b) || nan(g) || nan(p);
        bool whole = !has_nan && all_finite(a.rgb) && all_finite(b.rgb) && all_finite(vec3(a.a, b.a, g.w)) &&
                     all_finite(g.xyz) && all_finite(p.xyz) && finite(p.w);
        // A loop without iterations costs nothing, unlike a branch not taken.
        for (int bad = 0; bad < (inside && !whole ? 1 : 0); ++bad)
            atomicAdd(refused[has_nan ? kRefusedNan : kRefusedInfinite], 1u);
        bool good = same && whole && a.a >= 0.0 && p.w > 0.0;
        vec2 side = mix(1.0 - part, part, vec2(step));
        float weight = good ? side.x * side.y : 0.0;
        sum += weight;
        found.first += good ? weighed(a, weight) : vec4(0.0);
        found.second += good ? weighed(b, weight) : vec4(0.0);
    }
    const float kLeast = 0.01;  // least sum of the four weights
    if (sum < kLeast) return Earlier(vec4(0.0), vec4(0.0));
    return Earlier(light_of_sum(found.first, sum), light_of_sum(found.second, sum));
}

// Clips the light of both halves.
void clip(inout Earlier earlier, ivec2 pixel) {
    ivec2 last = textureSize(first, 0) - 1;
    vec3 sum = vec3(0.0);
    vec3 squares = vec3(0.0);
    float count = 0.0;
    for (int y = -kClipRadius; y <= kClipRadius; ++y) {
        for (int x = -kClipRadius; x <= kClipRadius; ++x) {
            ivec2 other = clamp(pixel + ivec2(x, y), ivec2(0), last);
            vec4 one = texelFetch(first, other, 0);
            vec3 light = squarable(light_of(one, texelFetch(second, other, 0)));  // 0 where no surface is visible
            sum += light;
            squares += light * light;
            count += one.a >= 0.0 ? 1.0 : 0.0;
        }
    }
    vec3 mean = sum / max(count, 1.0);
    vec3 reach = kClipDeviations * sqrt(max(squares / max(count, 1.0) - mean * mean, vec3(0.0)));
    earlier.first.rgb = clamp(earlier.first.rgb, mean - reach, mean + reach);
    earlier.second.rgb = clamp(earlier.second.rgb, mean - reach, mean + reach);
}

// Returns light with `kept` earlier samples.
vec4 with_earlier(vec4 now, vec4 earlier, float kept) {
    return kept > 0.0 ? vec4(mix(now.rgb, earlier.rgb, kept / (kept + now.a)), now.a + kept) : now;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(to_first)))) return;
    vec4 new_first = texelFetch(first, pixel, 0);
    vec4 new_second = texelFetch(second, pixel, 0);
    vec4 new_guide = texelFetch(guide, pixel, 0);
    vec4 new_place = texelFetch(place, pixel, 0);
    if (HALFLIGHT_HISTORY != 0) {
        vec3 at = new_place.xyz + origin_shift;
        if (HALFLIGHT_MOVED != 0) at = texelFetch(before, pixel, 0).xyz;
        Earlier earlier = earlier_at(at, new_guide.xyz);
        clip(earlier, pixel);
        float fading = clamp((kTemporalEnds - new_first.a - new_second.a) / (kTemporalEnds - 1.0), 0.0, 1.0);
        float there = earlier.first.a + earlier.second.a;
        float share = fading * earlier_share * min(there, kMostHistory) / max(there, 1e-30);
        share = new_place.w > 0.0 ? share : 0.0;
        new_first = with_earlier(new_first, earlier.first, share * earlier.first.a);
        new_second = with_earlier(new_second, earlier.second, share * earlier.second.a);
    }
    imageStore(to_first, pixel, new_first);
    imageStore(to_second, pixel, new_second);
    imageStore(to_guide, pixel, new_guide);
    imageStore(to_place, pixel, new_place);
}
