// Shades one vertex of the paths in a list: adds the light that they met, samples light, and continues or ends them.
//
// Variants: HALFLIGHT_FIRST_HIT (vertex 1, where light met is direct; HALFLIGHT_SHADOW_RAYS lights were sampled for
// it), HALFLIGHT_PENDING (the last vertex sampled a light), HALFLIGHT_LAST_VERTEX (all paths end),
// HALFLIGHT_LIGHT_SAMPLES (this one samples lights), HALFLIGHT_REUSE (vertex 1 keeps diffuse light apart for its group;
// SHADING.md, Path reuse), HALFLIGHT_RADIANCE_CACHE (a cell gives this light; the path's own light is kept apart for
// cells), HALFLIGHT_CACHE_TAKEN (a later vertex takes this light from a known cell, and keeps no light apart).
#include "shaders/shared/frame_block.h"
#include "shaders/shared/light.h"
#include "shaders/shared/path_state.h"
#include "shaders/shared/cache_cells.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/shared/reuse_groups.h"
#include "shaders/geometry_tables.glsl"  // tables of triangle lights
#include "shaders/scene_tables.glsl"

layout(local_size_x = 64) in;

layout(std140) uniform FrameBlock { Frame frame; };
// Storage blocks are scarce, so read-only inputs are texture buffers where possible.
uniform usamplerBuffer arriving;         // R32UI: path indices
uniform usamplerBuffer arriving_header;  // RGBA32UI: ListHeader
layout(std430) buffer PathRays { Ray path_rays[]; };
#include "shaders/lib/hit_texels.glsl"
layout(std430) buffer States { PathState states[]; };
#if HALFLIGHT_PENDING
uniform usamplerBuffer occluded;  // R32UI: answers to shadow rays
#if HALFLIGHT_SUN
uniform usamplerBuffer sun_occluded;  // R32UI: answers to sun rays
#endif
#endif
#if !HALFLIGHT_LAST_VERTEX
#if HALFLIGHT_LIGHT_SAMPLES
layout(std430) writeonly buffer ShadowRays { Ray shadow_rays[]; };
layout(std430) writeonly buffer Lit { uint lit[]; };
layout(std430) buffer LitHeader { ListHeader lit_header; };
#if HALFLIGHT_SUN
layout(std430) writeonly buffer SunRays { Ray sun_rays[]; };
#endif
#endif
layout(std430) writeonly buffer Leaving { uint leaving[]; };
layout(std430) buffer LeavingHeader { ListHeader leaving_header; };
#endif
#if HALFLIGHT_RECEIVERS
layout(std430) buffer Receivers { Receiver receivers[]; };  // origins of the rays
#endif
#if HALFLIGHT_SIZED_LIGHTS
uniform samplerBuffer met_lamps;  // RGBA32F: MetLamp, two texels each
#endif
#if HALFLIGHT_TEXTURE_LEVELS && !HALFLIGHT_LAST_VERTEX
#include "shaders/lib/ray_cone.glsl"
layout(std430) buffer Cones { RayCone cones[]; };
#endif
#if HALFLIGHT_VOLUME && !HALFLIGHT_LAST_VERTEX
layout(std430) buffer Media { vec4 media[]; };  // media of the rays (medium_towards())
#endif
// Diffuse light of vertex 1 is no part of the path's own light.
#define HALFLIGHT_APART (HALFLIGHT_REUSE || HALFLIGHT_RADIANCE_CACHE)
#define HALFLIGHT_CELLS (HALFLIGHT_RADIANCE_CACHE && !HALFLIGHT_REUSE && (HALFLIGHT_FIRST_HIT || HALFLIGHT_CACHE_TAKEN))
#define HALFLIGHT_CACHE_ASKED (HALFLIGHT_RADIANCE_CACHE && !HALFLIGHT_REUSE && HALFLIGHT_FIRST_HIT)
#if HALFLIGHT_REUSE
layout(std430) buffer Points { ReusePoint points[]; };
#elif HALFLIGHT_RADIANCE_CACHE
layout(std430) buffer Points { CachePoint points[]; };
#endif
#if HALFLIGHT_CACHE_ASKED
layout(std430) buffer Cells { CacheCell cells[]; };
#endif

#if HALFLIGHT_SUN && (HALFLIGHT_PENDING || HALFLIGHT_LIGHT_SAMPLES)
layout(std430) buffer SunLight { vec4 sun_light[]; };
#endif
#if HALFLIGHT_LIGHT_GROUPS
#include "shaders/lib/group_rows.glsl"
layout(std430) buffer GroupLight { vec4 group_light[]; };
#endif

uniform uint depth;  // number of this vertex, > 0

#include "shaders/lib/dimensions.glsl"
#include "shaders/lib/next_event.glsl"
#include "shaders/lib/occlusion.glsl"
#include "shaders/lib/path_list.glsl"
#include "shaders/lib/sun_light.glsl"
#include "shaders/lib/surface_record.glsl"
#if HALFLIGHT_CELLS
#include "shaders/lib/cache_lookup.glsl"
#endif

#if !HALFLIGHT_LAST_VERTEX
#if HALFLIGHT_LIGHT_SAMPLES
DEFINE_APPEND(append_lit, lit_header)
#endif
DEFINE_APPEND(append_leaving, leaving_header)
#endif

#if HALFLIGHT_LIGHT_GROUPS
// Adds light to a group. first: kOwnGroups or kGivenGroups.
void add_to_group(uint path, uint first, uint group, vec3 light) {
    if (contributes(light)) group_light[path * kGroupRows + first + group].rgb += light;
}
#endif

#if HALFLIGHT_SIZED_LIGHTS
float largest(vec3 light) { return max(light.r, max(light.g, light.b)); }

// Keeps the light `met` behind the lamp that the path has met, or that of the lamp, in proportion, because the light met
// at a vertex has one group. Returns whether it is the lamp's.
bool choose_met(uint path, inout vec3 met) {
    vec3 of_lamp = texelFetch(met_lamps, 2 * int(path)).rgb;
    float number = sample_1d(path_sampler(frame, path), vertex_dimension(depth, kDimensionLobe) + kDimensionsOfSizes);
    float of_both = largest(met) + largest(of_lamp);
    bool is_lamp = contributes(of_lamp) && !any(isnan(met)) && !(number * of_both < largest(met));
    float of_kept = is_lamp ? largest(of_lamp) : largest(met);
    met = (is_lamp ? of_lamp : met) * (of_kept > 0.0 && of_kept < of_both ? of_both / of_kept : 1.0);
    return is_lamp;
}
#endif

// Stores what this vertex may have changed: stores cost more than anything else here.
void store_state(uint path, PathState state) {
#if HALFLIGHT_FIRST_HIT
    states[path].direct = state.direct;
    states[path].reuse = state.reuse;
#endif
    states[path].indirect = state.indirect;
    states[path].pending_light = state.pending_light;
#if !HALFLIGHT_LAST_VERTEX
    states[path].throughput = state.throughput;
    states[path].pdf = state.pdf;
    states[path].pending = state.pending;
#endif
}

void main() {
    uint entry = gl_GlobalInvocationID.x;
    bool active_path = entry < texelFetch(arriving_header, 0).w;
    uint path = texelFetch(arriving, int(active_path ? entry : 0u)).x;
    Ray ray = path_rays[path];
    Hit hit = load_hit(path);
    PathState state = states[path];
    SurfacePoint at = load_surface_point(path);
    bool is_hit = at.is_surface;
    vec3 direction = normalize(ray.direction);
    vec3 wo = -direction;

#if HALFLIGHT_PENDING
    bool answers = state.pending_light != 0u;
    if (answers) state.indirect += answered_light(state.pending, texelFetch(occluded, int(path)).x);
#if HALFLIGHT_SUN
    if (answers) state.indirect += answered_light(sun_light[own_sun_light(path)].rgb, texelFetch(sun_occluded, int(path)).x);
#endif
#endif
#if HALFLIGHT_APART && !HALFLIGHT_FIRST_HIT
    bool has_point = (state.reuse & kReusePoint) != 0u;
    bool gives = (state.reuse & kReuseRest) != 0u;
    vec3 given = points[path].light;
#if HALFLIGHT_PENDING
    if (answers) given += answered_light(points[path].pending, texelFetch(occluded, int(path)).x);
#if HALFLIGHT_SUN
    if (answers) given += answered_light(sun_light[given_sun_light(path)].rgb, texelFetch(sun_occluded, int(path)).x);
#endif
#endif
#endif
#if HALFLIGHT_LIGHT_GROUPS
    uint groups = path * kGroupRows;
    if (active_path) {
#if HALFLIGHT_FIRST_HIT
        for (uint i = 1u; i < kGroupRows; ++i) group_light[groups + i] = vec4(0.0);
#endif
#if HALFLIGHT_PENDING
        if (answers) {
            uint group = word_of_float(group_light[groups].y);
            uint answer = texelFetch(occluded, int(path)).x;
            add_to_group(path, kOwnGroups, group, answered_light(state.pending, answer));
#if HALFLIGHT_REUSE
            add_to_group(path, kGivenGroups, group, answered_light(points[path].pending, answer));
#endif
#if HALFLIGHT_SUN
            uint of_sun = texelFetch(sun_occluded, int(path)).x;
            add_to_group(path, kOwnGroups, sun_group(), answered_light(sun_light[own_sun_light(path)].rgb, of_sun));
#if HALFLIGHT_REUSE
            add_to_group(path, kGivenGroups, sun_group(), answered_light(sun_light[given_sun_light(path)].rgb, of_sun));
#endif
#endif
        }
#endif
    }
#endif
    state.pending_light = 0u;

    // A miss looks up triangle 0 in vain, because the lanes of a register cannot diverge.
    hit.triangle = is_hit ? hit.triangle : 0u;
    hit.instance = is_hit ? hit.instance : 0u;
    vec3 geometric_normal = load_geometric_normal(path);

#if HALFLIGHT_RECEIVERS
    Receiver from = receivers[path];
#else
    Receiver from = receiver_at(vec3(0.0), vec3(0.0));  // any receiver will do
#endif
    float density = is_hit ? light_pdf(from, hit, direction, hit.t * length(ray.direction), geometric_normal)
                           : environment_pdf(from, direction);
#if HALFLIGHT_FIRST_HIT
    density *= float(HALFLIGHT_SHADOW_RAYS);  // event_of() has the same factor
#endif
    vec3 met = at.emission * (state.throughput * met_light_weight(state.pdf, density));
#if HALFLIGHT_LIGHT_GROUPS
    uint met_group = group_of_met(hit, is_hit);
#endif
#if HALFLIGHT_SIZED_LIGHTS
    bool keeps_lamp = choose_met(path, met);
#if HALFLIGHT_LIGHT_GROUPS
    met_group = keeps_lamp ? word_of_float(texelFetch(met_lamps, 2 * int(path) + 1).x) : met_group;
#endif
#endif
#if HALFLIGHT_LIGHT_GROUPS
#if HALFLIGHT_FIRST_HIT
    if (active_path) group_light[groups].x = float_of_word(met_group);
#else
    uint first_group = kOwnGroups;
#if HALFLIGHT_APART
    first_group = gives ? kGivenGroups : kOwnGroups;
#endif
    if (active_path) add_to_group(path, first_group, met_group, met);
#endif
#endif
#if HALFLIGHT_FIRST_HIT
    state.direct = met;
#elif HALFLIGHT_APART
    given += gives ? met : vec3(0.0);
    state.indirect += gives ? vec3(0.0) : met;
    if (active_path && has_point) points[path].light = given;
#else
    state.indirect += met;
#endif

#if HALFLIGHT_LAST_VERTEX
    if (active_path) store_state(path, state);
#else
    Bsdf b = load_bsdf(path);
#if HALFLIGHT_VOLUME
    vec4 before = media[path];
#else
    const vec4 before = vec4(0.0);
#endif
    Sampler random = path_sampler(frame, path);
#if HALFLIGHT_CELLS
    int finest = cache_level(distance(at.position, frame.camera_position.xyz));
    int levels = cache_levels(finest, hit.t * length(ray.direction), state.pdf, -dot(geometric_normal, direction));
    bool may_know = active_path && is_hit && state.pdf > 0.0 && levels > 0 && contributes(b.diffuse);
#if HALFLIGHT_DIFFUSE_TRANSMISSION
    may_know = may_know && !contributes(b.diffuse_through);  // cells hold the light on one side
#endif
#endif
#if HALFLIGHT_CACHE_TAKEN
    uint known = may_know && !gives ? known_cell(at.position, geometric_normal, finest, levels) : kNoCacheCell;
    vec3 from_cell = cache_mean(known == kNoCacheCell ? 0u : known);
    state.indirect += known != kNoCacheCell ? state.throughput * b.diffuse * from_cell : vec3(0.0);
    b.diffuse = known != kNoCacheCell ? vec3(0.0) : b.diffuse;
#endif
#if HALFLIGHT_APART
    vec3 given_pending = vec3(0.0);
    vec3 given_sun = vec3(0.0);
#if HALFLIGHT_FIRST_HIT
#if HALFLIGHT_REUSE
    bool has_point = is_hit && state.pdf > 0.0 && points[path].share > 0.0;
#if HALFLIGHT_PANES
    has_point = has_point && (state.reuse & kReuseThroughPane) == 0u;
#endif
    bool is_apart = has_point;
#else
    CachePoint point = cache_point(levels, state.throughput * b.diffuse);
    bool is_apart = may_know;
    float to_feed = sample_1d(random, vertex_dimension(depth, kDimensionRoulette));
    bool is_known = is_apart && find_cells(at.position, geometric_normal, finest, to_feed, point);
    bool has_point = is_apart && !is_known;
    b.diffuse = is_apart ? vec3(1.0) : b.diffuse;  // cells hold the light of albedo 1
#endif
#endif
#endif

#if HALFLIGHT_LIGHT_SAMPLES
    NextEvent e = sample_next_event(at.position, at.offset, b, wo, before, random,
                                    vertex_dimension(depth, kDimensionLight), 1u);
#if HALFLIGHT_APART && HALFLIGHT_FIRST_HIT
    given_pending = has_point ? e.diffuse : vec3(0.0);
    e.diffuse = is_apart ? vec3(0.0) : e.diffuse;
#endif
    state.pending = state.throughput * (e.diffuse + e.glossy);
    bool asks = contributes(state.pending);
#if HALFLIGHT_APART
#if HALFLIGHT_FIRST_HIT
    asks = asks || contributes(given_pending);
#else
    given_pending = gives ? state.pending : vec3(0.0);
    state.pending = gives ? vec3(0.0) : state.pending;
#endif
#endif
#if HALFLIGHT_SUN
    NextEvent sun = sample_sun_event(at.position, at.offset, b, wo, before, random,
                                     vertex_dimension(depth, kDimensionLight));
#if HALFLIGHT_APART && HALFLIGHT_FIRST_HIT
    given_sun = has_point ? sun.diffuse : vec3(0.0);
    sun.diffuse = is_apart ? vec3(0.0) : sun.diffuse;
#endif
    vec3 own_sun = state.throughput * (sun.diffuse + sun.glossy);
    bool asks_sun = contributes(own_sun);
#if HALFLIGHT_APART
#if HALFLIGHT_FIRST_HIT
    asks_sun = asks_sun || contributes(given_sun);
#else
    given_sun = gives ? own_sun : vec3(0.0);
    own_sun = gives ? vec3(0.0) : own_sun;
#endif
#endif
    if (!asks) e.ray = kDeadRay;
    if (!asks_sun) sun.ray = kDeadRay;
    asks = asks || asks_sun;
#endif
    bool is_lit = active_path && is_hit && asks;
#if HALFLIGHT_LIGHT_GROUPS
    if (is_lit) group_light[groups].y = float_of_word(e.group);
#endif
    state.pending_light = is_lit ? 1u : 0u;
#endif

    vec2 choice = sample_2d(random, vertex_dimension(depth, kDimensionLobe));
    vec2 xi = sample_2d(random, vertex_dimension(depth, kDimensionDirection));
    bool is_diffuse = picks_diffuse(b, choice.x);
#if HALFLIGHT_DIFFUSE
    BsdfSample s = sample_diffuse(b, wo, xi, choice.y);
#else
    BsdfSample s = sample_glossy(b, wo, xi, choice.y);
#endif
#if HALFLIGHT_DIFFUSE && HALFLIGHT_GLOSSY
    BsdfSample glossy = sample_glossy(b, wo, xi, choice.y);
    s.direction = is_diffuse ? s.direction : glossy.direction;
    s.weight = is_diffuse ? s.weight : glossy.weight;
    s.pdf = is_diffuse ? s.pdf : glossy.pdf;
#endif
#if HALFLIGHT_APART && HALFLIGHT_FIRST_HIT
    bool gives = has_point && is_diffuse;
    state.throughput = gives ? vec3(1.0) : state.throughput;  // each receiver has its own BSDF
    state.reuse = (has_point ? kReusePoint : 0u) | (gives ? kReuseRest : 0u);
#if HALFLIGHT_RADIANCE_CACHE
    state.reuse |= is_apart ? kReuseCell : 0u;
#endif
#endif
    float p = is_diffuse ? b.p_diffuse : 1.0 - b.p_diffuse;
    state.throughput *= s.weight / p;
    state.pdf = p * s.pdf;
    bool goes_on = active_path && is_hit && contributes(state.throughput);
#if HALFLIGHT_RADIANCE_CACHE && HALFLIGHT_FIRST_HIT
    goes_on = goes_on && !(is_known && is_diffuse);
#endif
    // Roulette would end a path with NaN throughput unnoticed. Here the path ends where it is counted.
    if (goes_on && !all_finite(state.throughput)) {
        state.indirect = state.throughput;
        goes_on = false;
    }
#if !HALFLIGHT_FIRST_HIT
    // Roulette starts at depth 3. The test is no variant, which would take longer to compile than it saves.
    float survival = min(max(state.throughput.r, max(state.throughput.g, state.throughput.b)), 0.95);
    bool survives = sample_1d(random, vertex_dimension(depth, kDimensionRoulette)) < survival;
    goes_on = goes_on && (depth < 3u || survives);
    state.throughput = depth < 3u ? state.throughput : state.throughput / survival;
#endif

#if HALFLIGHT_LIGHT_SAMPLES
    uint lit_place = append_lit(is_lit);
    if (is_lit) {
        shadow_rays[path] = e.ray;
#if HALFLIGHT_SUN
        sun_rays[path] = sun.ray;
        sun_light[own_sun_light(path)] = vec4(own_sun, 0.0);
#if HALFLIGHT_APART
        sun_light[given_sun_light(path)] = vec4(given_sun, 0.0);
#endif
#endif
        lit[lit_place] = path;
    }
#endif
    uint leaving_place = append_leaving(goes_on);
    if (goes_on) {
#if HALFLIGHT_BACKFACES
        bool marked = ray.t_min > 0.0 && state.pdf == 0.0;
#else
        const bool marked = false;
#endif
        path_rays[path] = ray_from(at.position, at.offset, b.geometric_normal, s.direction, marked);
        leaving[leaving_place] = path;
#if HALFLIGHT_TEXTURE_LEVELS
        cones[path] = scattered_cone(cones[path], hit.t * length(ray.direction), s.pdf);
#endif
#if HALFLIGHT_VOLUME
        media[path] = medium_towards(b, before, s.direction);
#endif
#if HALFLIGHT_RECEIVERS
        receivers[path] = receiver_at(at.position, b.geometric_normal);
#endif
    }
#if HALFLIGHT_APART
#if HALFLIGHT_FIRST_HIT && HALFLIGHT_RADIANCE_CACHE
    point.pending = given_pending;
    if (active_path && is_apart) points[path] = point;
#else
    if (active_path && has_point) points[path].pending = given_pending;
#endif
#endif
    if (active_path) store_state(path, state);
#endif
}
