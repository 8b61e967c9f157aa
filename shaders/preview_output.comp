// Replaces the reflected light of the mean by light accumulated over earlier pictures, which may be filtered.
#include "shaders/shared/preview_constants.h"

layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D beauty;
uniform sampler2D albedo;
uniform sampler2D first;  // halves of the reflected light contained in `beauty`
uniform sampler2D second;
uniform sampler2D accumulated_first;  // halves of the light accumulated over earlier pictures
uniform sampler2D accumulated_second;
// Inputs with HALFLIGHT_FILTERED:
uniform sampler2D filtered_first;  // halves of accumulated light, filtered (LightHalves)
uniform sampler2D filtered_second;
uniform sampler2D spread;  // rgb: light of fireflies over albedo, spread
layout(rgba32f) writeonly uniform image2D picture;

#include "shaders/lib/finite.glsl"
#include "shaders/lib/luminance.glsl"
#include "shaders/lib/preview_light.glsl"

// Returns the filtered light at a pixel. Alpha is 0 where there is none. Where neighbours served as one of the halves
// (shaders/preview_halves.comp), the halves count alike, or else their checkerboard would be seen.
vec4 filtered_at(ivec2 pixel) {
    vec4 one = texelFetch(filtered_first, pixel, 0);
    bool single = min(texelFetch(accumulated_first, pixel, 0).a, texelFetch(accumulated_second, pixel, 0).a) <= 0.0;
    vec3 light = mix(texelFetch(filtered_second, pixel, 0).rgb, one.rgb, single ? 0.5 : one.a);
    return vec4(light + texelFetch(spread, pixel, 0).rgb, one.a);
}

// Returns the filtered light, but none brighter than the brightest of the pixels around. Single bright pixels at edges
// are unlike all others, so that the filter has left them.
vec4 despeckled(ivec2 pixel) {
    vec4 own = filtered_at(pixel);
    ivec2 size = textureSize(filtered_first, 0);
    vec3 brightest = vec3(0.0);
    float most = -1.0;  // luminance of `brightest`; negative: none was seen
    for (int i = 0; i < 9; ++i) {
        ivec2 other = pixel + ivec2(i % 3, i / 3) - 1;
        bool inside = all(greaterThanEqual(other, ivec2(0))) && all(lessThan(other, size)) && i != 4;
        vec4 there = filtered_at(clamp(other, ivec2(0), size - 1));
        float value = luminance_of(there.rgb);
        bool brighter = inside && there.a > 0.0 && value > most;
        brightest = brighter ? there.rgb : brightest;
        most = brighter ? value : most;
    }
    bool speckle = most >= 0.0 && luminance_of(own.rgb) > most;
    return vec4(speckle ? brightest : own.rgb, own.a);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(picture)))) return;
    vec4 mean = texelFetch(beauty, pixel, 0);
    vec4 one = texelFetch(first, pixel, 0);
    vec4 two = texelFetch(second, pixel, 0);
    vec3 own = light_of(one, two);
    vec3 shown = light_of(texelFetch(accumulated_first, pixel, 0), texelFetch(accumulated_second, pixel, 0));
    if (HALFLIGHT_FILTERED != 0) {
        vec4 filtered = despeckled(pixel);
        float strength = clamp((kFilterEnds - one.a - two.a) / (kFilterEnds - kFilterWeakens), 0.0, 1.0);
        shown += filtered.a > 0.0 ? strength * (filtered.rgb - shown) : vec3(0.0);
    }
    // Where no light was replaced, the sum adds nothing: the mean stays as it is, bit for bit.
    vec3 made = max(mean.rgb + texelFetch(albedo, pixel, 0).rgb * (shown - own), vec3(0.0));
    bool good = one.a >= 0.0 && all_finite(made) && all(greaterThanEqual(mean.rgb, vec3(0.0)));
    imageStore(picture, pixel, vec4(good ? made : mean.rgb, mean.a));
}
