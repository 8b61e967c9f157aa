// Converts the sums of a band to texels of the whole picture, for preview passes.
#include "shaders/shared/aov_record.h"
#include "shaders/shared/denoise.h"
#include "shaders/shared/pixel_order.h"
#include "shaders/shared/preview_constants.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/lib/beauty_sums.glsl"

layout(local_size_x = 64) in;

layout(std430) readonly buffer Features { double features[]; };   // albedo, normal
layout(std430) readonly buffer HalfSums { double half_sums[]; };  // Accumulated::halves
uniform sampler2D mean;                                           // beauty of the band

// Images of the whole picture; passes/preview/preview_texels.h describes their content.
layout(rgba32f) writeonly uniform image2D first;
layout(rgba32f) writeonly uniform image2D second;
layout(rgba32f) writeonly uniform image2D guide;
layout(rgba32f) writeonly uniform image2D albedo;
layout(rgba32f) writeonly uniform image2D beauty;
OPTIONAL(HALFLIGHT_PLACES) layout(std430) readonly buffer Records { AovRecord records[]; };
layout(rgba32f) writeonly uniform image2D place;  // HALFLIGHT_PLACES

uniform float samples;
uniform float first_samples;  // number of samples of the first half
uniform uint stride;          // number of doubles per path in `half_sums`
uniform ivec2 size;           // size of the band within the picture, pixels
uniform int first_row;        // first row of the band
uniform uvec2 tiles;          // size of the band, tiles

#include "shaders/lib/finite.glsl"

void main() {
    uint path = gl_GlobalInvocationID.x;
    ivec2 pixel = ivec2(pixel_of_path(path, tiles));
    double covered = emission[path * 4u + 3u];
    double of_covered = covered > 0.0LF ? 1.0LF / covered : 0.0LF;
    float second_samples = samples - first_samples;
    vec3 reflectance, normal, of_first, of_second;
    for (uint i = 0u; i < 3u; ++i) {
        double whole = with_reflected(0.0LF, path, i);
        uint at = path * stride + i;
        double own = half_sums[at] + half_sums[at + 3u] + half_sums[at + 6u];
        double rest = max(whole - own, 0.0LF);
        reflectance[i] = max(float(features[path * 6u + i] / double(samples)), kLeastFilteredAlbedo);
        normal[i] = float(features[path * 6u + 3u + i] * of_covered);
        double most = double(kMostFilteredLight);
        of_first[i] = first_samples > 0.0 ? float(min(own / (double(first_samples) * reflectance[i]), most)) : 0.0;
        of_second[i] = second_samples > 0.0 ? float(min(rest / (double(second_samples) * reflectance[i]), most)) : 0.0;
    }
    float depth = float(half_sums[path * stride + 12u] * of_covered);
    bool seen = covered > 0.0LF && all_finite(normal) && all_finite(of_first) && all_finite(of_second) &&
                all_finite(reflectance) && finite(depth);
    if (pixel.x < size.x && pixel.y < size.y) {
        ivec2 to = pixel + ivec2(0, first_row);
        imageStore(first, to, seen ? vec4(of_first, first_samples) : vec4(0.0, 0.0, 0.0, -1.0));
        imageStore(second, to, seen ? vec4(of_second, second_samples) : vec4(0.0, 0.0, 0.0, -1.0));
        imageStore(guide, to, seen ? vec4(normal, depth) : vec4(0.0));
        imageStore(albedo, to, seen ? vec4(reflectance, 1.0) : vec4(0.0));
        imageStore(beauty, to, texelFetch(mean, pixel, 0));
        if (HALFLIGHT_PLACES != 0) {
            AovRecord record = records[path];
            imageStore(place, to, seen && record.triangle != kMiss ? vec4(record.position, 1.0) : vec4(0.0));
        }
    }
}
