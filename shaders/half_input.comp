// Converts the sums of one component of a band to two halves of light over albedo, textures of the whole picture.
#include "shaders/lib/beauty_sums.glsl"
#include "shaders/lib/half_sums.glsl"
#include "shaders/shared/pixel_order.h"

layout(local_size_x = 64) in;

layout(std430) readonly buffer Features { double features[]; };   // albedo, normal
layout(std430) readonly buffer HalfSums { double half_sums[]; };  // Accumulated::halves

layout(rgba32f) writeonly uniform image2D first;
layout(rgba32f) writeonly uniform image2D second;

uniform int component;  // FilteredLight
uniform uint samples;
uniform uint first_samples;  // number of samples in the first half
uniform ivec2 size;          // size of the band within the picture, pixels
uniform int first_row;       // first row of the band
uniform uvec2 tiles;         // size of the band, tiles

const int kIndirectDiffuse = 1;
const int kGlossy = 2;

// Returns the sum of the component over all samples.
double whole_sum(uint path, uint channel) {
    double sum = 0.0LF;
    uint at = path * 6u + channel + (component == kGlossy ? 3u : 0u);
    if (kDirect && component != kIndirectDiffuse) sum += direct[at];
    if (kIndirect && component != 0) sum += indirect[at];
    return sum;
}

void main() {
    uint path = gl_GlobalInvocationID.x;
    ivec2 pixel = ivec2(pixel_of_path(path, tiles));
    bool filtered = first_samples > 0u && first_samples < samples;
    bool good = filtered && emission[path * 4u + 3u] > 0.0LF;
    vec3 of_first, of_second;
    for (uint i = 0u; i < 3u; ++i) {
        double own = half_sums[path * kHalfStride + uint(component) * 3u + i];
        double rest = max(whole_sum(path, i) - own, 0.0LF);
        double albedo = half_sums[path * kHalfStride + 9u + i];
        if (component == kGlossy) albedo = features[path * 6u + i] - albedo;
        if (kSpecularChains && component == kGlossy) albedo += half_sums[path * kHalfStride + kHalfSums + i];
        albedo = max(albedo / double(samples), double(kLeastFilteredAlbedo));
        of_first[i] = float(min(own / (double(max(first_samples, 1u)) * albedo), double(kMostFilteredLight)));
        of_second[i] =
            float(min(rest / (double(max(samples - first_samples, 1u)) * albedo), double(kMostFilteredLight)));
    }
    float share = float(first_samples) / float(samples);
    if (pixel.x < size.x && pixel.y < size.y) {
        ivec2 to = pixel + ivec2(0, first_row);
        imageStore(first, to, good ? vec4(of_first, share) : vec4(0.0));
        imageStore(second, to, good ? vec4(of_second, share) : vec4(0.0));
    }
}
