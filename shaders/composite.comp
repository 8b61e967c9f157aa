// Computes the mean of the components' sums. HALFLIGHT_VIEW adds the view transform, whose GLSL stands above.
// HALFLIGHT_STRAIGHT_VIEW divides its colours by alpha.
#include "shaders/shared/pixel_order.h"
#include "shaders/lib/beauty_sums.glsl"
#include "shaders/lib/finite.glsl"

const bool kCatchers = HALFLIGHT_CATCHERS != 0;

layout(local_size_x = 64) in;

OPTIONAL(HALFLIGHT_CATCHERS) layout(std430) readonly buffer Catchers { double catchers[]; };  // Accumulated::catchers
layout(rgba32f) writeonly uniform image2D beauty;
layout(rgba32f) writeonly uniform image2D view;
uniform float exposure_scale;

uniform uint samples;
uniform ivec2 size;   // size of the band, pixels
uniform uvec2 tiles;  // size of the band, tiles

void main() {
    uint path = gl_GlobalInvocationID.x;
    ivec2 pixel = ivec2(pixel_of_path(path, tiles));
    double share = 1.0LF / double(samples);
    vec4 mean = vec4(0.0);
    // SHADING.md, Shadow catchers
    double without = kCatchers ? catchers[path * 9u + 1u] : 0.0LF;
    double shadow = without > 0.0LF ? max(1.0LF - catchers[path * 9u] / without, 0.0LF) : 0.0LF;
    for (uint i = 0u; i < 3u; ++i) {
        double sum = beauty_sum(path, i);
        if (kCatchers) sum = max(sum - shadow * catchers[path * 9u + 3u + i], 0.0LF);
        mean[i] = float(min(sum * share, double(kLargestFloat)));  // finite parts may add up to more
    }
    double covered = emission[path * 4u + 3u];
    if (kCatchers) covered += shadow * catchers[path * 9u + 2u];
    mean.a = HALFLIGHT_OPAQUE_BACKGROUND != 0 ? 1.0 : float(covered * share);
    if (pixel.x < size.x && pixel.y < size.y) {
        imageStore(beauty, pixel, mean);
#if HALFLIGHT_VIEW
        vec3 color = mean.rgb;
        if (HALFLIGHT_STRAIGHT_VIEW != 0) color = mean.a > 0.0 ? mean.rgb / mean.a : vec3(0.0);
        imageStore(view, pixel, vec4(ocio_view(vec4(color * exposure_scale, 1.0)).rgb, mean.a));
#endif
    }
}
