// Non-local means of two half buffers (Rousselle, Knaus, Zwicker 2012, Adaptive Rendering with Non-Local Means
// Filtering, equations 2 to 5): patches of one half decide the weights of the other. Features of surfaces bound the
// weights from above (Rousselle, Manzi, Zwicker 2013).
//
// A work group filters a tile. For each offset within the window it compares all pixels of the tile with those at the
// offset, and sums the differences over patches by columns and rows.
const int kTile = 32;     // width and height of the tile, pixels
const bool kPreview = HALFLIGHT_PREVIEW != 0;
const int kPatch = kPreview ? 1 : 3;   // radius of patches, pixels
const int kWindow = kPreview ? 2 : 7;  // radius of the window, multiples of the distance of offsets
uniform int stride;                    // previews: distance of the offsets, pixels; else it is 1
// Small windows let pixels at the edge of two surfaces, which resemble few others, take light from both. Large ones would
// take too much of it beyond corners, where light changes.
const float kMixed = kPreview ? 1.0 : 0.0;
const int kOwn = 4;       // number of pixels in a row that an invocation filters
const int kWide = kTile + 2 * kPatch;
const float kStrength = 0.4;   // k of equation 2; larger values blur more
// Share of the variance of a noisier pixel that explains differences from it. With 0, as in equation 2, bright pixels
// give light to dark ones that do not take it; with 1, dark pixels take too much. In between, the light is kept to 1 %.
const float kBrighter = 0.4;
const float kMostApart = 1e4;  // largest difference of two pixels, in variances

layout(local_size_x = kTile / kOwn, local_size_y = kTile) in;

uniform sampler2D light;  // rg: luminance of the halves; b: variance; a: share of the first half, 0: nothing to filter
uniform sampler2D first;
uniform sampler2D second;
uniform sampler2D guide;        // xyz: normal; w: ln(depth)
uniform sampler2D reflectance;  // rgb: albedo; a: number of mirrors before the surface
layout(rgba32f) writeonly uniform image2D filtered_first;
layout(rgba32f) writeonly uniform image2D filtered_second;

shared vec2 apart[kWide * kWide];    // differences of pixels, by half
shared vec2 columns[kTile * kWide];  // sums of differences over the columns of patches

// Returns the differences of a pixel and another one in both halves, beyond what noise explains, in variances (equation
// 2 of Rousselle et al. 2012).
vec2 difference(ivec2 p, ivec2 q, ivec2 size) {
    vec4 own = texelFetch(light, clamp(p, ivec2(0), size - 1), 0);
    vec4 other = texelFetch(light, clamp(q, ivec2(0), size - 1), 0);
    vec2 between = own.rg - other.rg;
    // Half the squared difference of the halves is the variance of either if they have as many samples.
    vec2 parts = 2.0 * vec2(1.0 - own.a, own.a);
    vec2 noise = parts * (own.b + mix(min(own.b, other.b), other.b, kBrighter));
    vec2 scale = parts * (own.b + other.b) * kStrength * kStrength;
    bool both = own.a > 0.0 && other.a > 0.0;
    return both ? min((between * between - noise) / scale, vec2(kMostApart)) : vec2(0.0);
}

#include "shaders/lib/surface_likeness.glsl"

// Returns the sums over the patches of the pixels that an invocation filters, along rows or columns.
vec2[kOwn] patch_sums(vec2 v[kOwn + 2 * kPatch]) {
#if HALFLIGHT_PREVIEW
    return vec2[](v[0] + v[1] + v[2], v[1] + v[2] + v[3], v[2] + v[3] + v[4], v[3] + v[4] + v[5]);
#else
    // The sums start with what they share.
    vec2 middle = v[3] + v[4] + v[5] + v[6];
    return vec2[](v[0] + v[1] + v[2] + middle, v[1] + v[2] + middle + v[7], v[2] + middle + v[7] + v[8],
                  middle + v[7] + v[8] + v[9]);
#endif
}

void main() {
    ivec2 size = imageSize(filtered_first);
    ivec2 corner = ivec2(gl_WorkGroupID.xy) * kTile;
    ivec2 local = ivec2(gl_LocalInvocationID.xy);
    ivec2 from = corner + ivec2(kOwn * local.x, local.y);
    vec4 own_guide[kOwn];
    vec4 own_albedo[kOwn];
    vec3 own_first[kOwn], own_second[kOwn];
    vec3 sum_first[kOwn], sum_second[kOwn];  // weighted sums of differences from the pixel's own light
    vec2 weights[kOwn];                      // sums of weights
    for (int k = 0; k < kOwn; ++k) {
        ivec2 pixel = min(from + ivec2(k, 0), size - 1);
        own_guide[k] = texelFetch(guide, pixel, 0);
        own_albedo[k] = texelFetch(reflectance, pixel, 0);
        own_first[k] = texelFetch(first, pixel, 0).rgb;
        own_second[k] = texelFetch(second, pixel, 0).rgb;
        sum_first[k] = vec3(0.0);
        sum_second[k] = vec3(0.0);
        weights[k] = vec2(0.0);
    }
    for (int oy = -kWindow; oy <= kWindow; ++oy) {
        for (int ox = -kWindow; ox <= kWindow; ++ox) {
            ivec2 offset = (kPreview ? stride : 1) * ivec2(ox, oy);
            for (int y = local.y; y < kWide; y += kTile) {
                for (int x = local.x; x < kWide; x += kTile / kOwn) {
                    ivec2 p = corner + ivec2(x, y) - kPatch;
                    apart[y * kWide + x] = difference(p, p + offset, size);
                }
            }
            barrier();
            // A quarter of the invocations sum four rows each, so that these share values.
            for (int y = kOwn * local.y; y < kTile; y += kOwn * kTile) {
                for (int x = local.x; x < kWide; x += kTile / kOwn) {
                    vec2 below[kOwn + 2 * kPatch];
                    for (int i = 0; i < kOwn + 2 * kPatch; ++i) below[i] = apart[(y + i) * kWide + x];
                    vec2 sums[kOwn] = patch_sums(below);
                    for (int k = 0; k < kOwn; ++k) columns[(y + k) * kWide + x] = sums[k];
                }
            }
            barrier();
            vec2 beside[kOwn + 2 * kPatch];
            for (int i = 0; i < kOwn + 2 * kPatch; ++i) beside[i] = columns[local.y * kWide + kOwn * local.x + i];
            vec2 patches[kOwn] = patch_sums(beside);
            for (int k = 0; k < kOwn; ++k) {
                ivec2 q = from + ivec2(k, 0) + offset;
                bool inside = all(greaterThanEqual(q, ivec2(0))) && all(lessThan(q, size));
                q = clamp(q, ivec2(0), size - 1);
                vec4 other_first = texelFetch(first, q, 0);
                vec3 other_second = texelFetch(second, q, 0).rgb;
                float alike = likeness(own_guide[k], own_albedo[k], texelFetch(guide, q, 0),
                                       texelFetch(reflectance, q, 0), kMixed);
                vec2 weight = exp(-max(patches[k] / float((2 * kPatch + 1) * (2 * kPatch + 1)), vec2(0.0)));
                weight *= inside && other_first.a > 0.0 ? alike : 0.0;
                // The second half decides about the first one, and the first half about the second one.
                sum_first[k] += weight.y * (other_first.rgb - own_first[k]);
                sum_second[k] += weight.x * (other_second - own_second[k]);
                weights[k] += weight.yx;
            }
        }
    }
    for (int k = 0; k < kOwn; ++k) {
        ivec2 pixel = from + ivec2(k, 0);
        if (any(greaterThanEqual(pixel, size))) continue;
        vec2 scale = 1.0 / max(weights[k], vec2(1e-20));
        float share = texelFetch(first, pixel, 0).a;
        imageStore(filtered_first, pixel, vec4(own_first[k] + scale.x * sum_first[k], share));
        imageStore(filtered_second, pixel, vec4(own_second[k] + scale.y * sum_second[k], share));
    }
}
