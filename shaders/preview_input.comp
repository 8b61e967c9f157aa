// Converts the sums of a band to texels of the whole picture, for preview passes.
#include "shaders/shared/aov.h"
#include "shaders/shared/pixel_order.h"
#include "shaders/shared/preview.h"
#include "shaders/shared/rays.h"

layout(local_size_x = 64) in;

layout(std430) readonly buffer Emission { double emission[]; };  // rgb, coverage
#ifdef HALFLIGHT_DIRECT
layout(std430) readonly buffer Direct { double direct[]; };  // diffuse rgb, glossy rgb
#endif
#ifdef HALFLIGHT_INDIRECT
layout(std430) readonly buffer Indirect { double indirect[]; };  // diffuse rgb, glossy rgb
#endif
layout(std430) readonly buffer Squares { double squares[]; };    // squares of the beauty
layout(std430) readonly buffer Features { double features[]; };  // albedo, normal
layout(std430) readonly buffer Records { AovRecord records[]; };
uniform sampler2D mean;  // beauty of the band

// Images of the whole picture; passes/preview/preview_texels.h describes their content.
layout(rgba32f) writeonly uniform image2D light;
layout(rgba32f) writeonly uniform image2D guide;
layout(rgba32f) writeonly uniform image2D place;
layout(rgba32f) writeonly uniform image2D albedo;
layout(rgba32f) writeonly uniform image2D beauty;

uniform uint samples;
uniform ivec2 size;     // size of the band within the picture, pixels
uniform int first_row;  // first row of the band
uniform uvec2 tiles;    // size of the band, tiles

#include "shaders/lib/finite.glsl"
#include "shaders/lib/luminance.glsl"

void main() {
    uint path = gl_GlobalInvocationID.x;
    ivec2 pixel = ivec2(pixel_of_path(path, tiles));
    double share = 1.0LF / double(samples);
    vec3 reflectance, normal, reflected_light;
    float luminance = 0.0;
    float deviation = 0.0;
    for (uint i = 0u; i < 3u; ++i) {
        double reflected = 0.0LF;
#ifdef HALFLIGHT_DIRECT
        reflected += direct[path * 6u + i] + direct[path * 6u + 3u + i];
#endif
#ifdef HALFLIGHT_INDIRECT
        reflected += indirect[path * 6u + i] + indirect[path * 6u + 3u + i];
#endif
        double whole = (reflected + emission[path * 4u + i]) * share;
        reflectance[i] = max(float(features[path * 6u + i] * share), kLeastAlbedo);
        normal[i] = float(features[path * 6u + 3u + i] * share);
        reflected_light[i] = float(reflected * share) / reflectance[i];
        luminance += kToLuminance[i] * reflected_light[i];
        // Except at edges, emission is equal for all samples of a pixel. The noise of the channels is correlated.
        double variance = max(squares[path * 3u + i] * share - whole * whole, 0.0LF);
        deviation += kToLuminance[i] * sqrt(float(variance)) / reflectance[i];
    }
    AovRecord record = records[path];
    float square = luminance * luminance + deviation * deviation;
    float length_of_normal = length(normal);
    bool seen = record.triangle != kMiss && length_of_normal > 0.0 && finite(length_of_normal) && finite(square) &&
                all_finite(reflected_light) && all_finite(reflectance) && record.depth > 0.0;
    if (pixel.x < size.x && pixel.y < size.y) {
        ivec2 to = pixel + ivec2(0, first_row);
        imageStore(light, to, seen ? vec4(reflected_light, square) : vec4(0.0, 0.0, 0.0, -1.0));
        imageStore(guide, to, seen ? vec4(normal / length_of_normal, record.depth) : vec4(0.0));
        imageStore(place, to, vec4(seen ? record.position : vec3(0.0), float(samples)));
        imageStore(albedo, to, vec4(reflectance, 1.0));
        imageStore(beauty, to, texelFetch(mean, pixel, 0));
    }
}
