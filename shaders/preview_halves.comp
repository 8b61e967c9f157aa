// Prepares preview texels for the filter by two halves (passes/picture/denoiser.h). If all samples are in one half,
// the mean of the four pixels beside it serves as the other half. They swap halves in a checkerboard, so that both
// halves consist of different pixels.
layout(local_size_x = 8, local_size_y = 8) in;

// passes/preview/preview_texels.h describes the content of these textures.
uniform sampler2D first;
uniform sampler2D second;
uniform sampler2D guide;
uniform sampler2D albedo;
layout(rgba32f) writeonly uniform image2D half_first;  // see LightHalves
layout(rgba32f) writeonly uniform image2D half_second;

#include "shaders/lib/preview_light.glsl"
#include "shaders/lib/surface_likeness.glsl"

const float kLeastBeside = 0.1;  // sum of the weights below which the pixels beside show other surfaces

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(half_first);
    if (any(greaterThanEqual(pixel, size))) return;
    vec4 one = texelFetch(first, pixel, 0);
    vec4 two = texelFetch(second, pixel, 0);
    vec4 own_guide = texelFetch(guide, pixel, 0);
    vec4 own_albedo = texelFetch(albedo, pixel, 0);
    vec3 sum = vec3(0.0);
    float weights = 0.0;
    float squares = 0.0;
    for (int i = 0; i < 4; ++i) {
        ivec2 other = pixel + (1 - 2 * (i & 1)) * ivec2(i >> 1, 1 - (i >> 1));
        bool inside = all(greaterThanEqual(other, ivec2(0))) && all(lessThan(other, size));
        other = clamp(other, ivec2(0), size - 1);
        vec4 other_first = texelFetch(first, other, 0);
        float weight = likeness(own_guide, own_albedo, texelFetch(guide, other, 0), texelFetch(albedo, other, 0), 0.0);
        weight = inside && other_first.a >= 0.0 ? weight : 0.0;
        sum += weight * light_of(other_first, texelFetch(second, other, 0));
        weights += weight;
        squares += weight * weight;
    }
    vec3 own = light_of(one, two);
    float samples = one.a + two.a;
    float share = one.a / max(samples, 1.0);
    bool lacks = min(one.a, two.a) <= 0.0;
    bool paired = weights > kLeastBeside;
    vec3 beside = sum / max(weights, kLeastBeside);
    float variance = squares / max(weights * weights, kLeastBeside * kLeastBeside);  // relative to that of `own`
    bool even = ((pixel.x + pixel.y) & 1) == 0;
    // The share of a half is such that its variance is proportional to the share of the other half.
    share = lacks ? (even ? variance : 1.0) / (1.0 + variance) : share;
    bool good = samples > 0.0 && (!lacks || paired);
    imageStore(half_first, pixel, good ? vec4(lacks ? (even ? own : beside) : one.rgb, share) : vec4(0.0));
    imageStore(half_second, pixel, good ? vec4(lacks ? (even ? beside : own) : two.rgb, share) : vec4(0.0));
}
