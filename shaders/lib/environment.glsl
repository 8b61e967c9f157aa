// Light from infinity (Environment in engine/scene/scene.h). Needs shaders/scene_tables.glsl.
#include "shaders/lib/onb.glsl"
#include "shaders/shared/environment.h"

// Returns u = atan2(d.z, d.x) / 2pi + 0.5, v = acos(d.y) / pi. acos is computed by atan, because it loses half of its
// bits at the poles.
vec2 environment_uv(vec3 d) {
    float around = length(d.xz);
    return vec2(around > 0.0 ? atan(d.z, d.x) * 0.159154943092 + 0.5 : 0.5, atan(around, d.y) * 0.318309886184);
}

vec3 environment_texel_blend(vec2 uv) {
    ivec2 size = textureSize(environment_map, 0);
    vec2 x = uv * vec2(size) - 0.5;
    vec2 cell = floor(x);
    vec2 f = x - cell;
    ivec2 c = ivec2(cell);
    int left = c.x < 0 ? size.x - 1 : c.x;
    int right = c.x + 1 >= size.x ? 0 : c.x + 1;
    left = min(left, size.x - 1);  // u = 1
    int top = clamp(c.y, 0, size.y - 1);
    int bottom = clamp(c.y + 1, 0, size.y - 1);
    vec3 a = texelFetch(environment_map, ivec2(left, top), 0).rgb;
    vec3 b = texelFetch(environment_map, ivec2(right, top), 0).rgb;
    vec3 d = texelFetch(environment_map, ivec2(left, bottom), 0).rgb;
    vec3 e = texelFetch(environment_map, ivec2(right, bottom), 0).rgb;
    return mix(mix(a, b, f.x), mix(d, e, f.x), f.y);
}

// Returns the radiance from direction d, of unit length.
vec3 environment_radiance(vec3 d) {
#if defined(HALFLIGHT_ENVIRONMENT_MAP)
    return environment_texel_blend(environment_uv(d));
#elif defined(HALFLIGHT_ENVIRONMENT)
    return texelFetch(environment_warp, 1).rgb;
#else
    return vec3(0.0);
#endif
}

#ifdef HALFLIGHT_ENVIRONMENT_MAP
// Returns the solid angle of a cell in `row` of `rows`. `per_sine`: texel 1 of the table.
float cell_solid_angle(float row, float rows, float per_sine) {
    return per_sine * sin(3.14159265359 * (row + 0.5) / rows);
}
#endif

// Returns the density per solid angle with which sample_light() selects direction d (unit) of the environment.
float environment_pdf(vec3 d) {
    vec4 head = texelFetch(environment_warp, 0);
#if defined(HALFLIGHT_ENVIRONMENT_MAP)
    vec4 layout_of = texelFetch(environment_warp, 1);
    // An atan rounded beyond pi leaves [0, 1] at either end.
    ivec2 cell = ivec2(clamp(floor(environment_uv(d) * head.xy), vec2(0.0), head.xy - 1.0));
    int node = (cell.y >> 1) * ((int(head.x) + 1) >> 1) + (cell.x >> 1);
    float weight = texelFetch(environment_warp, int(layout_of.x) + node)[2 * (cell.y & 1) + (cell.x & 1)];
    return head.z * weight / cell_solid_angle(float(cell.y), head.y, layout_of.y);
#elif defined(HALFLIGHT_ENVIRONMENT)
    return head.z * 0.0795774715459;
#else
    return 0.0;
#endif
}

struct EnvironmentSample {
    vec3 direction;
    vec3 radiance;
    float pdf;  // density per solid angle, including the probability of the environment among all lights
};

#ifdef HALFLIGHT_ENVIRONMENT_MAP
// Returns whether x selects the second of two parts. Replaces x by its place in the selected part, in [0, 1).
bool selects_second(inout float x, float first, float second) {
    float share = first / (first + second);
    bool selected = x >= share;
    x = min(selected ? (x - share) / (1.0 - share) : x / share, 0.99999994);
    return selected;
}
#endif

// Samples a direction by a point of the unit square.
EnvironmentSample sample_environment(vec2 xi) {
    EnvironmentSample s;
    vec4 head = texelFetch(environment_warp, 0);
#ifdef HALFLIGHT_ENVIRONMENT_MAP
    vec4 layout_of = texelFetch(environment_warp, 1);
    int levels = int(head.w);
    int first = kEnvironmentFirstNode;
    ivec2 at = ivec2(0);
    float weight = 0.0;
    for (int below = levels; below > 0; --below) {
        ivec2 size = (ivec2(head.xy) + (1 << below) - 1) >> below;
        vec4 weights = texelFetch(environment_warp, first + at.y * size.x + at.x);
        bool lower = selects_second(xi.y, weights.x + weights.y, weights.z + weights.w);
        vec2 pair = lower ? weights.zw : weights.xy;
        bool right = selects_second(xi.x, pair.x, pair.y);
        weight = right ? pair.y : pair.x;
        at = 2 * at + ivec2(right ? 1 : 0, lower ? 1 : 0);
        first += size.x * size.y;
    }
    s.pdf = head.z * weight / cell_solid_angle(float(at.y), head.y, layout_of.y);
    // Uniform per solid angle means linear in cos(theta). Thin rows use the sines of half sum and half difference.
    float top = 3.14159265359 * float(at.y) / head.y;
    float bottom = 3.14159265359 * float(at.y + 1) / head.y;
    float cosine = cos(top) - xi.y * 2.0 * sin(0.5 * (top + bottom)) * sin(0.5 * (bottom - top));
    float sine = sqrt(max(0.0, (1.0 - cosine) * (1.0 + cosine)));
    float u = (float(at.x) + xi.x) / head.x;
    float phi = 6.28318530718 * (u - 0.5);
    s.direction = vec3(sine * cos(phi), cosine, sine * sin(phi));
    s.radiance = environment_texel_blend(vec2(u, atan(sine, cosine) * 0.318309886184));
#else
    s.direction = sphere_direction(1.0 - 2.0 * xi.y, xi.x);
    s.radiance = texelFetch(environment_warp, 1).rgb;
    s.pdf = head.z * 0.0795774715459;
#endif
    return s;
}
