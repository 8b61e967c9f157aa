// Scales the sums of each pixel as if it had `wanted` samples.
layout(local_size_x = 64) in;

layout(std430) buffer Sums { double sums[]; };
uniform usamplerBuffer counts;  // R32UI: number of samples of each 16x16 block
uniform usamplerBuffer first_counts;  // R32UI: number of samples of each block in the first half

uniform uint stride;  // number of values of a path
uniform uint wanted;
uniform uint of_first_half;  // number of leading values that are sums over the first half alone

void main() {
    uint path = gl_GlobalInvocationID.x;
    int block = int(path >> 8);
    double scale = double(wanted) / double(texelFetch(counts, block).x);
    double of_half = double(wanted / 2u) / double(texelFetch(first_counts, block).x);
    for (uint i = 0u; i < stride; ++i) sums[path * stride + i] *= i < of_first_half ? of_half : scale;
}
