// Converts sums of surface properties of a band to the denoiser's textures of the whole picture.
#include "shaders/lib/half_sums.glsl"
#include "shaders/shared/pixel_order.h"

layout(local_size_x = 64) in;

layout(std430) readonly buffer Emission { double emission[]; };   // rgb, coverage
layout(std430) readonly buffer Features { double features[]; };   // albedo, normal
layout(std430) readonly buffer HalfSums { double half_sums[]; };  // Accumulated::halves
uniform sampler2D beauty;                                         // mean of the band

// Images of the whole picture; passes/picture/denoiser.h describes their content.
layout(rgba32f) writeonly uniform image2D mean;
layout(rgba32f) writeonly uniform image2D guide;
layout(rgba32f) writeonly uniform image2D reflectance;
layout(rgba32f) writeonly uniform image2D diffuse_albedo;
layout(rgba32f) writeonly uniform image2D glossy_albedo;
layout(rgba32f) writeonly uniform image2D glossy_guide;  // with specular chains, like the next one
layout(rgba32f) writeonly uniform image2D glossy_reflectance;

uniform uint samples;
uniform uint first_samples;
uniform ivec2 size;     // size of the band within the picture, pixels
uniform int first_row;  // first row of the band
uniform uvec2 tiles;    // size of the band, tiles

void main() {
    uint path = gl_GlobalInvocationID.x;
    ivec2 pixel = ivec2(pixel_of_path(path, tiles));
    double share = 1.0LF / double(samples);
    double covered = emission[path * 4u + 3u];
    double of_covered = covered > 0.0LF ? 1.0LF / covered : 0.0LF;
    vec3 all, diffuse, glossy, normal;
    vec3 instead, turned;  // differences that specular chains make in the mean albedo and normal
    uint at = path * kHalfStride;
    for (uint i = 0u; i < 3u; ++i) {
        double whole = features[path * 6u + i];
        double own = half_sums[at + 9u + i];
        all[i] = float(whole * of_covered);
        diffuse[i] = max(float(own * share), kLeastFilteredAlbedo);
        double of_glossy = whole - own;
        if (kSpecularChains) {
            of_glossy += half_sums[at + kHalfSums + i];
            instead[i] = float(half_sums[at + kHalfSums + i] * of_covered);
            turned[i] = float(half_sums[at + kHalfSums + 3u + i] * of_covered);
        }
        glossy[i] = max(float(of_glossy * share), kLeastFilteredAlbedo);
        normal[i] = float(features[path * 6u + 3u + i] * of_covered);
    }
    float depth = float(half_sums[at + 12u] * of_covered);
    if (pixel.x < size.x && pixel.y < size.y) {
        ivec2 to = pixel + ivec2(0, first_row);
        imageStore(mean, to, texelFetch(beauty, pixel, 0));
        imageStore(guide, to, vec4(normal, depth));
        imageStore(reflectance, to, vec4(all, 1.0));
        imageStore(diffuse_albedo, to, vec4(diffuse, 1.0));
        imageStore(glossy_albedo, to, vec4(glossy, 1.0));
        if (kSpecularChains) {
            float behind = float(half_sums[at + kHalfSums + 6u] * of_covered);
            float bounces = float(half_sums[at + kHalfSums + 7u] * of_covered);
            imageStore(glossy_guide, to, vec4(normal + turned, depth + behind));
            imageStore(glossy_reflectance, to, vec4(all + instead, bounces));
        }
    }
}
