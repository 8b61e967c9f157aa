// Light from infinity (Environment in engine/scene/scene.h). Needs shaders/scene_tables.glsl.
#include "shaders/lib/onb.glsl"
#include "shaders/lib/sobol.glsl"
#include "shaders/shared/environment.h"
#include "shaders/shared/word.h"

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
    return texelFetch(environment_cells, 1).rgb;
#else
    return vec3(0.0);
#endif
}

// Returns the density per solid angle with which sample_light() selects direction d (unit) of the environment.
float environment_pdf(vec3 d) {
#if defined(HALFLIGHT_ENVIRONMENT_MAP)
    vec2 cells = texelFetch(environment_cells, 0).xy;
    // An atan rounded beyond pi leaves [0, 1] at either end.
    vec2 cell = clamp(floor(environment_uv(d) * cells), vec2(0.0), cells - 1.0);
    return texelFetch(environment_cells, kEnvironmentFirstCell + int(cell.y) * int(cells.x) + int(cell.x)).z;
#elif defined(HALFLIGHT_ENVIRONMENT)
    return texelFetch(environment_cells, 0).z * 0.0795774715459;
#else
    return 0.0;
#endif
}

struct EnvironmentSample {
    vec3 direction;
    vec3 radiance;
    float pdf;  // density per solid angle, including the probability of the environment among all lights
};

// Samples a direction. `choice`: 32 uniform bits that select the cell; `xi`: the point in the cell.
EnvironmentSample sample_environment(uint choice, vec2 xi) {
    EnvironmentSample s;
    vec4 head = texelFetch(environment_cells, 0);
#ifdef HALFLIGHT_ENVIRONMENT_MAP
    uint rows = uint(head.y);
    uint columns = uint(head.x);
    uint cell, fraction;
    umulExtended(choice, rows * columns, cell, fraction);
    vec4 row = texelFetch(environment_cells, kEnvironmentFirstCell + int(cell));
    bool keep = unit_float(fraction) < row.x;
    cell = keep ? cell : word_of_float(row.y);
    s.pdf = keep ? row.z : row.w;
    uint y = cell / columns;
    // Uniform per solid angle means linear in cos(theta). Thin rows use the sines of half sum and half difference.
    float top = 3.14159265359 * float(y) / head.y;
    float bottom = 3.14159265359 * float(y + 1u) / head.y;
    float cosine = cos(top) - xi.y * 2.0 * sin(0.5 * (top + bottom)) * sin(0.5 * (bottom - top));
    float sine = sqrt(max(0.0, (1.0 - cosine) * (1.0 + cosine)));
    float u = (float(cell - y * columns) + xi.x) / head.x;
    float phi = 6.28318530718 * (u - 0.5);
    s.direction = vec3(sine * cos(phi), cosine, sine * sin(phi));
    s.radiance = environment_texel_blend(vec2(u, atan(sine, cosine) * 0.318309886184));
#else
    s.direction = sphere_direction(1.0 - 2.0 * xi.y, xi.x);
    s.radiance = texelFetch(environment_cells, 1).rgb;
    s.pdf = head.z * 0.0795774715459;
#endif
    return s;
}
