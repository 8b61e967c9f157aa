// Computes the weighted sum of two pictures' sums.
layout(local_size_x = 64) in;

layout(std430) readonly buffer Biased { double biased[]; };
layout(std430) readonly buffer Unbiased { double unbiased[]; };
layout(std430) writeonly buffer Both { double both[]; };

uniform uint values;
uniform float weight_biased;
uniform float weight_unbiased;

void main() {
    // Bands have more values than drivers allow invocations.
    for (uint i = gl_GlobalInvocationID.x; i < values; i += gl_NumWorkGroups.x * 64u)
        both[i] = double(weight_biased) * biased[i] + double(weight_unbiased) * unbiased[i];
}
