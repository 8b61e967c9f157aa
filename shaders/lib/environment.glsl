// Light from infinity (Environment in engine/scene/scene.h). Needs shaders/scene_tables.glsl.
#include "shaders/lib/luminance.glsl"
#include "shaders/lib/onb.glsl"
#include "shaders/shared/arctangent.h"
#include "shaders/shared/environment_texels.h"

const bool kEnvironment = HALFLIGHT_ENVIRONMENT != 0;
const bool kEnvironmentMap = HALFLIGHT_ENVIRONMENT_MAP != 0;  // else, its radiance is uniform

// Returns u = atan2(d.z, d.x) / 2pi + 0.5, v = acos(d.y) / pi. acos is computed by the arctangent, because it loses
// half of its bits at the poles.
vec2 environment_uv(vec3 d) {
    float around = length(d.xz);
    float longitude = around > 0.0 ? arctangent(d.z, d.x) * 0.159154943092 : 0.0;
    return vec2(longitude + 0.5, arctangent(around, d.y) * 0.318309886184);
}

ivec2 environment_size() { return ivec2(texelFetch(environment_warp, 2).yz); }
vec3 environment_texel(int x, int y, ivec2 size) { return texelFetch(environment_map, y * size.x + x).rgb; }

vec3 environment_texel_blend(vec2 uv) {
    ivec2 size = environment_size();
    vec2 x = uv * vec2(size) - 0.5;
    vec2 cell = floor(x);
    vec2 f = x - cell;
    ivec2 c = ivec2(cell);
    int left = c.x < 0 ? size.x - 1 : c.x;
    int right = c.x + 1 >= size.x ? 0 : c.x + 1;
    left = min(left, size.x - 1);  // u = 1
    int top = clamp(c.y, 0, size.y - 1);
    int bottom = clamp(c.y + 1, 0, size.y - 1);
    vec3 a = environment_texel(left, top, size);
    vec3 b = environment_texel(right, top, size);
    vec3 d = environment_texel(left, bottom, size);
    vec3 e = environment_texel(right, bottom, size);
    return mix(mix(a, b, f.x), mix(d, e, f.x), f.y);
}

// Returns the radiance from direction d, of unit length.
vec3 environment_radiance(vec3 d) {
    if (kEnvironmentMap) return environment_texel_blend(environment_uv(d));
    return kEnvironment ? texelFetch(environment_warp, 1).rgb : vec3(0.0);
}

// Header of the table (shaders/shared/environment_texels.h).
struct EnvironmentLayout {
    vec2 cells;  // columns, rows
    int levels;
    float per_sine;   // solid angle of a cell over the sine of its middle's polar angle
    int last_level;   // first texel of the last level
    int block_level;  // first texel of the level below the blocks
    int lobes;        // first texel of the lobes
    int lobe_levels;  // levels above the blocks
};

EnvironmentLayout environment_layout() {
    vec4 head = texelFetch(environment_warp, 0), first = texelFetch(environment_warp, 1);
    int lobe_levels = int(texelFetch(environment_warp, 2).x);
    return EnvironmentLayout(head.xy, int(head.w), first.x, int(first.y), int(first.z), int(first.w), lobe_levels);
}

// Returns the first texel of the lobe of a receiver's normal.
int environment_lobe(EnvironmentLayout l, vec3 normal) {
    const int kSide = kEnvironmentLobes;
    float sum = abs(normal.x) + abs(normal.y) + abs(normal.z);
    vec2 p = normal.xy / sum;
    if (normal.z < 0.0) p = (1.0 - abs(p.yx)) * vec2(p.x < 0.0 ? -1.0 : 1.0, p.y < 0.0 ? -1.0 : 1.0);
    ivec2 at = clamp(ivec2((0.5 * p + 0.5) * float(kSide)), 0, kSide - 1);
    return l.lobes + (sum > 0.0 ? at.y * kSide + at.x : kSide * kSide) * environment_lobe_texels(l.lobe_levels);
}

// Returns the solid angle of a cell.
float cell_solid_angle(EnvironmentLayout l, int row) {
    return l.per_sine * sin(3.14159265359 * (float(row) + 0.5) / l.cells.y);
}

float sum_of(vec4 weights) { return (weights.x + weights.y) + (weights.z + weights.w); }

// Returns whether x selects the second of two parts. Replaces x by its place in the selected part, in [0, 1).
bool selects_second(inout float x, float first, float second) {
    float sum = first + second;
    float share = sum > 0.0 ? first / sum : 1.0;
    bool selected = second > 0.0 && x >= share;  // division may round the share of all to less than 1
    x = min(selected ? (x - share) / (1.0 - share) : x / share, 0.99999994);
    return selected;
}

// Returns whether cells are texels. Directions within a cell then follow the bilinear luminance.
bool cells_are_texels(EnvironmentLayout l) { return ivec2(l.cells) == environment_size(); }

// Returns the luminances of a texel's row and of the rows above and below it, each with both neighbours, as columns.
mat3 luminances_around(ivec2 texel) {
    ivec2 size = environment_size();
    mat3 found;
    for (int j = 0; j < 3; ++j) {
        for (int i = 0; i < 3; ++i) {
            ivec2 at = texel + ivec2(i, j) - 1;
            at.x = at.x < 0 ? size.x - 1 : (at.x >= size.x ? 0 : at.x);
            found[j][i] = luminance_of(environment_texel(at.x, clamp(at.y, 0, size.y - 1), size));
        }
    }
    return found;
}

// Integral of the bilinear interpolation over a texel, along one axis, by the values of three texels.
const vec3 kTexelMean = vec3(0.125, 0.75, 0.125);

// Samples a place in a texel, in [0, 1], by the values of three texels that are interpolated linearly.
float sample_in_texel(float x, vec3 values) {
    vec3 knots = vec3(0.5 * (values.x + values.y), values.y, 0.5 * (values.y + values.z));
    bool right = selects_second(x, knots.x + knots.y, knots.y + knots.z);
    vec2 ramp = right ? knots.yz : knots.xy;
    if (!(ramp.x + ramp.y > 0.0)) return 0.5;
    ramp /= ramp.x + ramp.y;
    float place = x > 0.0 ? min(x / (ramp.x + sqrt(mix(ramp.x * ramp.x, ramp.y * ramp.y, x))), 1.0) : 0.0;
    return 0.5 * (place + (right ? 1.0 : 0.0));
}

// Returns the values of a texel's column and of its neighbours, interpolated at the place y in the texel.
vec3 interpolated_rows(mat3 rows, float y) {
    return y < 0.5 ? mix(rows[0], rows[1], y + 0.5) : mix(rows[1], rows[2], y - 0.5);
}

// Returns the density per solid angle of a cell in which u and v are uniform.
float cell_density(EnvironmentLayout l, float probability, float sine) {
    return probability * l.cells.x * l.cells.y / (19.7392088022 * max(sine, 1e-7));
}

// Returns the density per solid angle within a texel of this mean luminance.
float texel_density(EnvironmentLayout l, float probability, float mean, vec3 radiance, float sine) {
    return mean > 0.0 ? luminance_of(radiance) * cell_density(l, probability / mean, sine) : 0.0;
}

float mean_of_texel(mat3 rows) { return dot(kTexelMean, rows * kTexelMean); }

// Returns the illuminance that the environment gives a surface with a normal if nothing is in between, lux.
float environment_illuminance(vec3 normal) {
    if (kEnvironmentMap) return texelFetch(environment_warp, environment_lobe(environment_layout(), normal)).x;
    return kEnvironment ? texelFetch(environment_warp, 1).w : 0.0;
}

const float kUniformDensity = 0.0795774715459;  // 1 / (4 pi)

// Returns the density per solid angle with which sample_environment() selects direction d (unit).
float environment_density(vec3 normal, vec3 d) {
    if (!kEnvironmentMap) return kEnvironment ? kUniformDensity : 0.0;
    EnvironmentLayout l = environment_layout();
    // An atan rounded beyond pi leaves [0, 1] at either end.
    ivec2 cell = ivec2(clamp(floor(environment_uv(d) * l.cells), vec2(0.0), l.cells - 1.0));
    ivec2 block = cell >> (l.levels - l.lobe_levels);
    int top = (1 << (2 * (l.lobe_levels - 1))) / 3;  // nodes of the levels above the blocks' parents
    int parent = ((block.y >> 1) << (l.lobe_levels - 1)) + (block.x >> 1);
    int lobe = environment_lobe(l, normal);
    float density = texelFetch(environment_warp, lobe + 1 + top + parent)[2 * (block.y & 1) + (block.x & 1)];
    if (l.levels > l.lobe_levels) {
        int below = l.levels - l.lobe_levels;
        int columns = (int(l.cells.x) + (1 << below) - 1) >> below;
        float whole = sum_of(texelFetch(environment_warp, l.block_level + block.y * columns + block.x));
        if (cells_are_texels(l)) {
            // The weight of a texel is its share of the map's integral, so it need not be looked up.
            float integral = 4.0 * texelFetch(environment_warp, environment_lobe(l, vec3(0.0))).x;
            float probability = density * cell_solid_angle(l, cell.y);
            return texel_density(l, probability, whole * integral, environment_radiance(d), length(d.xz));
        }
        int node = l.last_level + (cell.y >> 1) * ((int(l.cells.x) + 1) >> 1) + (cell.x >> 1);
        float weight = texelFetch(environment_warp, node)[2 * (cell.y & 1) + (cell.x & 1)];
        density *= whole > 0.0 ? weight / whole : 0.0;
    }
    if (cells_are_texels(l)) {
        float mean = mean_of_texel(luminances_around(cell));
        return texel_density(l, density, mean, environment_radiance(d), length(d.xz));
    }
    return cell_density(l, density, length(d.xz));
}

struct EnvironmentSample {
    vec3 direction;
    vec3 radiance;
    float density;  // density per solid angle among directions of the environment
};

// Samples a direction for a receiver's normal by a point of the unit square.
EnvironmentSample sample_environment(vec3 normal, vec2 xi) {
    EnvironmentSample s;
    if (!kEnvironmentMap) {
        s.direction = sphere_direction(1.0 - 2.0 * xi.y, xi.x);
        s.radiance = texelFetch(environment_warp, 1).rgb;
        s.density = kUniformDensity;
        return s;
    }
    EnvironmentLayout l = environment_layout();
    int in_lobe = environment_lobe(l, normal) + 1;
    int in_level = l.block_level;
    ivec2 at = ivec2(0);
    float density = 1.0, whole = 1.0;
    for (int level = 0; level < l.levels; ++level) {
        bool above = level < l.lobe_levels;
        int below = l.levels - level;
        int columns = (int(l.cells.x) + (1 << below) - 1) >> below;
        int rows = (int(l.cells.y) + (1 << below) - 1) >> below;
        vec4 weights = texelFetch(environment_warp, above ? in_lobe + (at.y << level) + at.x
                                                          : in_level + at.y * columns + at.x);
        in_lobe += 1 << (2 * level);
        in_level += above ? 0 : columns * rows;
        whole = level == l.lobe_levels ? sum_of(weights) : whole;
        bool lower = selects_second(xi.y, weights.x + weights.y, weights.z + weights.w);
        vec2 pair = lower ? weights.zw : weights.xy;
        bool right = selects_second(xi.x, pair.x, pair.y);
        float weight = right ? pair.y : pair.x;
        at = 2 * at + ivec2(right ? 1 : 0, lower ? 1 : 0);
        if (level == l.lobe_levels - 1) density = weight;
        if (level == l.levels - 1 && !above) density *= whole > 0.0 ? weight / whole : 0.0;
    }
    float mean = 0.0;
    if (cells_are_texels(l)) {
        mat3 rows = luminances_around(at);
        mean = mean_of_texel(rows);
        xi.y = sample_in_texel(xi.y, kTexelMean * rows);
        xi.x = sample_in_texel(xi.x, interpolated_rows(rows, xi.y));
    }
    vec2 uv = (vec2(at) + xi) / l.cells;
    float sine = sin(3.14159265359 * min(uv.y, 1.0 - uv.y)), phi = 6.28318530718 * (uv.x - 0.5);
    s.direction = vec3(sine * cos(phi), cos(3.14159265359 * uv.y), sine * sin(phi));
    s.radiance = environment_texel_blend(uv);
    s.density = cells_are_texels(l) ? texel_density(l, density, mean, s.radiance, sine)
                                    : cell_density(l, density, sine);
    return s;
}
