// Computes the mean of the components' sums. HALFLIGHT_VIEW adds the view transform, whose GLSL stands above.
// HALFLIGHT_STRAIGHT_VIEW divides its colours by alpha.
#include "shaders/shared/pixel_order.h"
#include "shaders/lib/finite.glsl"

layout(local_size_x = 64) in;

layout(std430) readonly buffer Emission { double emission[]; };  // rgb, coverage
#if HALFLIGHT_DIRECT
layout(std430) readonly buffer Direct { double direct[]; };  // diffuse rgb, glossy rgb
#endif
#if HALFLIGHT_INDIRECT
layout(std430) readonly buffer Indirect { double indirect[]; };  // diffuse rgb, glossy rgb
#endif
#if HALFLIGHT_CATCHERS
layout(std430) readonly buffer Catchers { double catchers[]; };  // Accumulated::catchers
#endif
layout(rgba32f) writeonly uniform image2D beauty;
#if HALFLIGHT_VIEW
layout(rgba32f) writeonly uniform image2D view;
uniform float exposure_scale;
#endif

uniform uint samples;
uniform ivec2 size;   // size of the band, pixels
uniform uvec2 tiles;  // size of the band, tiles

void main() {
    uint path = gl_GlobalInvocationID.x;
    ivec2 pixel = ivec2(pixel_of_path(path, tiles));
    double share = 1.0LF / double(samples);
    vec4 mean = vec4(0.0);
#if HALFLIGHT_CATCHERS
    // SHADING.md, Shadow catchers
    double without = catchers[path * 6u + 1u];
    double shadow = without > 0.0LF ? max(1.0LF - catchers[path * 6u] / without, 0.0LF) : 0.0LF;
#endif
    for (uint i = 0u; i < 3u; ++i) {
        double sum = emission[path * 4u + i];
#if HALFLIGHT_DIRECT
        sum += direct[path * 6u + i] + direct[path * 6u + 3u + i];
#endif
#if HALFLIGHT_INDIRECT
        sum += indirect[path * 6u + i] + indirect[path * 6u + 3u + i];
#endif
#if HALFLIGHT_CATCHERS
        sum = max(sum - shadow * catchers[path * 6u + 3u + i], 0.0LF);
#endif
        mean[i] = float(min(sum * share, double(kLargestFloat)));  // finite parts may add up to more
    }
#if HALFLIGHT_OPAQUE_BACKGROUND
    mean.a = 1.0;
#else
    double covered = emission[path * 4u + 3u];
#if HALFLIGHT_CATCHERS
    covered += shadow * catchers[path * 6u + 2u];
#endif
    mean.a = float(covered * share);
#endif
    if (pixel.x < size.x && pixel.y < size.y) {
        imageStore(beauty, pixel, mean);
#if HALFLIGHT_VIEW
#if HALFLIGHT_STRAIGHT_VIEW
        vec3 color = mean.a > 0.0 ? mean.rgb / mean.a : vec3(0.0);
#else
        vec3 color = mean.rgb;
#endif
        imageStore(view, pixel, vec4(ocio_view(vec4(color * exposure_scale, 1.0)).rgb, mean.a));
#endif
    }
}
