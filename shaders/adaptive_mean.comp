// Scales the sums of each pixel as if it had `wanted` samples.
layout(local_size_x = 64) in;

layout(std430) buffer Sums { double sums[]; };
uniform usamplerBuffer counts;  // R32UI: number of samples of each 16x16 block

uniform uint stride;  // number of values of a path
uniform uint wanted;

void main() {
    uint path = gl_GlobalInvocationID.x;
    double scale = double(wanted) / double(texelFetch(counts, int(path >> 8)).x);
    for (uint i = 0u; i < stride; ++i) sums[path * stride + i] *= scale;
}
