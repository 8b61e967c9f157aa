// Computes sums over the neighbours in a row or column, weighted by a triangle. Weights sum up to 1; pixels outside the
// picture count as 0.
layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D source;
layout(rgba32f) writeonly uniform image2D sum;

uniform ivec2 stride;  // (1, 0): along rows; (0, 1): along columns
uniform int radius;    // pixels, >= 0

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(sum);
    if (any(greaterThanEqual(pixel, size))) return;
    float scale = 1.0 / float((radius + 1) * (radius + 1));
    vec4 total = vec4(0.0);
    for (int i = -radius; i <= radius; ++i) {
        ivec2 other = pixel + i * stride;
        bool inside = all(greaterThanEqual(other, ivec2(0))) && all(lessThan(other, size));
        vec4 value = texelFetch(source, clamp(other, ivec2(0), size - 1), 0);
        total += inside ? scale * float(radius + 1 - abs(i)) * value : vec4(0.0);
    }
    imageStore(sum, pixel, total);
}
