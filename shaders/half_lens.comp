// Smooths the properties of surfaces within circles of confusion, before a picture with depth of field is denoised.
//
// A blurred pixel shows many points, so the means of its properties are noisy. Light was divided by a noisy albedo,
// too: that noise would remain in the picture. Properties of blurred surfaces change slowly from pixel to pixel. They
// are averaged with those of other pixels that lie within both pixels' circles of confusion, scaled down. Sharp pixels
// stay as they are. Light is then divided by the new albedo instead of the old one, which changes no mean.
//
// HALFLIGHT_LIGHT converts the halves of light; otherwise, a property is smoothed.
#include "shaders/shared/denoise.h"

layout(local_size_x = 8, local_size_y = 8) in;

// Inputs of light:
uniform sampler2D half_before;
uniform sampler2D albedo_before;
uniform sampler2D albedo_after;
// Inputs of a property:
uniform sampler2D before;
uniform sampler2D guide;  // w: ln(depth)
uniform vec3 blur;        // radius of the circle of confusion at a depth, pixels: |blur.x + blur.y / depth + blur.z depth|

layout(rgba32f) writeonly uniform image2D after;

const int kMostRadius = 5;      // pixels
const float kRadiusShare = 0.5;  // share of the circle's radius that counts

// Returns the radius at a pixel; 0 where there is no surface.
float radius_at(ivec2 pixel) {
    vec4 g = texelFetch(guide, pixel, 0);
    float depth = exp(clamp(g.w, -80.0, 80.0));
    return g == vec4(0.0) ? 0.0 : kRadiusShare * abs(blur.x + blur.y / depth + blur.z * depth);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(after);
    if (any(greaterThanEqual(pixel, size))) return;
    if (HALFLIGHT_LIGHT != 0) {
        vec4 own = texelFetch(half_before, pixel, 0);
        vec3 scale = texelFetch(albedo_before, pixel, 0).rgb / texelFetch(albedo_after, pixel, 0).rgb;
        imageStore(after, pixel, vec4(min(own.rgb * scale, vec3(kMostFilteredLight)), own.a));
        return;
    }
    float radius = radius_at(pixel);
    int reach = int(min(radius, float(kMostRadius)));
    vec4 sum = vec4(0.0);
    float count = 0.0;
    for (int y = -reach; y <= reach; ++y) {
        for (int x = -reach; x <= reach; ++x) {
            ivec2 other = pixel + ivec2(x, y);
            bool inside = all(greaterThanEqual(other, ivec2(0))) && all(lessThan(other, size));
            other = clamp(other, ivec2(0), size - 1);
            float within = min(radius, radius_at(other));
            float weight = inside && float(x * x + y * y) <= within * within ? 1.0 : 0.0;
            sum += weight * texelFetch(before, other, 0);
            count += weight;
        }
    }
    imageStore(after, pixel, sum / max(count, 1.0));
}
