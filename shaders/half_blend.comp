// Replaces the light of one component: fireflies are spread, and filtered light is blended in as far as it is expected
// to be nearer to the truth.
layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D first;
uniform sampler2D second;
uniform sampler2D calm_first;  // halves without fireflies
uniform sampler2D calm_second;
uniform sampler2D filtered_first;
uniform sampler2D filtered_second;
uniform sampler2D spread;  // rgb: light of fireflies, spread; a: HALFLIGHT_OVER_FRAMES: share of means over frames
uniform sampler2D errors;  // rgb: terms of significant_share(), averaged
uniform sampler2D albedo;
uniform sampler2D picture_before;
uniform sampler2D weights_before;  // HALFLIGHT_WEIGHTS_BEFORE
layout(rgba32f) writeonly uniform image2D picture;
layout(rgba32f) writeonly uniform image2D weights;

uniform int component;  // channel of the component in `weights`
uniform float squares;  // of significant_share(); 0: best_share()

#include "shaders/lib/finite.glsl"
#include "shaders/lib/halves.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(picture)))) return;
    vec4 one = texelFetch(first, pixel, 0);
    vec4 before = texelFetch(picture_before, pixel, 0);
    vec4 shares = vec4(0.0, 0.0, 0.0, 1.0);
    if (HALFLIGHT_WEIGHTS_BEFORE != 0) shares = texelFetch(weights_before, pixel, 0);
    float share = one.a > 0.0 ? significant_share(texelFetch(errors, pixel, 0).rgb, squares) : 0.0;
    vec3 mean = mean_of(one, texelFetch(second, pixel, 0));
    vec3 calm = mix(texelFetch(calm_second, pixel, 0).rgb, texelFetch(calm_first, pixel, 0).rgb, one.a);
    vec3 filtered = mix(texelFetch(filtered_second, pixel, 0).rgb, texelFetch(filtered_first, pixel, 0).rgb, one.a);
    vec4 spread_here = texelFetch(spread, pixel, 0);
    vec3 change = calm - mean + spread_here.rgb + share * (filtered - calm);
    // Where nothing is changed, the sum adds nothing: the mean stays as it is, bit for bit.
    vec3 made = max(before.rgb + texelFetch(albedo, pixel, 0).rgb * change, vec3(0.0));
    bool good = one.a > 0.0 && all_finite(made);
    if (HALFLIGHT_OVER_FRAMES != 0) share = 1.0 - (1.0 - share) * (1.0 - spread_here.a);
    shares[component] = good ? share : 0.0;
    imageStore(picture, pixel, vec4(good ? made : before.rgb, before.a));
    imageStore(weights, pixel, shares);
}
