// Replaces the reflected light of the mean by light accumulated over earlier pictures, which may be filtered.
#include "shaders/shared/preview.h"

layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D beauty;
uniform sampler2D albedo;
uniform sampler2D light;        // reflected light contained in `beauty`
uniform sampler2D place;        // w: number of samples of the beauty
uniform sampler2D accumulated;  // light, accumulated over earlier pictures
#ifdef HALFLIGHT_FILTERED
uniform sampler2D filtered;  // accumulated light, filtered
#endif
layout(rgba32f) writeonly uniform image2D picture;

#include "shaders/lib/finite.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(picture)))) return;
    vec4 mean = texelFetch(beauty, pixel, 0);
    vec4 own = texelFetch(light, pixel, 0);
    vec3 shown = texelFetch(accumulated, pixel, 0).rgb;
#ifdef HALFLIGHT_FILTERED
    float samples = texelFetch(place, pixel, 0).w;
    float strength = clamp((kFilterEnds - samples) / (kFilterEnds - kFilterWeakens), 0.0, 1.0);
    shown += strength * (texelFetch(filtered, pixel, 0).rgb - shown);
#endif
    // Where no light was replaced, the sum adds nothing: the mean stays as it is, bit for bit.
    vec3 made = max(mean.rgb + texelFetch(albedo, pixel, 0).rgb * (shown - own.rgb), vec3(0.0));
    bool good = own.a >= 0.0 && all_finite(made) && all(greaterThanEqual(mean.rgb, vec3(0.0)));
    imageStore(picture, pixel, vec4(good ? made : mean.rgb, mean.a));
}
