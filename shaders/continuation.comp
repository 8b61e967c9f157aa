// Shades one vertex of the paths in a list, and sends its shadow rays and its next ray.
//
// main() is the sequence of steps; each step is a function above it. In the words of SHADING.md, Estimator:
//   next-event estimation             sample_lights(); the next vertex adds its light, add_sampled_light()
//   multiple importance sampling      event_of() of shaders/lib/next_event.glsl for light samples, add_met_light() for
//                                     light that the ray has met: the power heuristic (Veach 1995)
//   BSDF sampling                     scatter()
//   Russian roulette                  survives_roulette()
#include "shaders/shared/frame_block.h"
#include "shaders/shared/light.h"
#include "shaders/shared/path_state.h"
#include "shaders/shared/cache_cells.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/shared/reuse_groups.h"
#include "shaders/geometry_tables.glsl"  // tables of triangle lights
#include "shaders/scene_tables.glsl"

layout(local_size_x = 64) in;

// --- Variants --------------------------------------------------------------------------------------------------------

const bool kFirstHit = HALFLIGHT_FIRST_HIT != 0;          // vertex 1, where light met is direct light
const bool kLastVertex = HALFLIGHT_LAST_VERTEX != 0;      // all paths end here
const bool kPending = HALFLIGHT_PENDING != 0;             // the last vertex sampled lights
const bool kLightSamples = HALFLIGHT_LIGHT_SAMPLES != 0;  // this vertex samples lights; false at the last one
const bool kReceivers = HALFLIGHT_RECEIVERS != 0;         // densities of light samples depend on the ray's origin

// Light that leaves vertex 1 diffusely is kept at a point (PathPoint), apart from the path's own light. It is for the
// other paths of its group (SHADING.md, Path reuse), or for cells of the radiance cache.
const bool kReuse = HALFLIGHT_REUSE != 0;
const bool kCache = HALFLIGHT_RADIANCE_CACHE != 0;
const bool kPoints = kReuse || kCache;
const bool kAsksCells = HALFLIGHT_CACHE_ASKED != 0;  // vertex 1 asks cells for its diffuse light
const bool kTakesCells = HALFLIGHT_CACHE_TAKEN != 0;  // vertex 2 takes diffuse light from cells that are known already
// Vertex 1 makes the point. Later vertices add what the path finds after leaving vertex 1 diffusely.
const bool kMakesPoint = kPoints && kFirstHit && !kLastVertex;

// --- Bindings --------------------------------------------------------------------------------------------------------

layout(std140) uniform FrameBlock { Frame frame; };
// Storage blocks are scarce, so read-only inputs are texture buffers where possible.
uniform usamplerBuffer arriving;         // R32UI: path indices
uniform usamplerBuffer arriving_header;  // RGBA32UI: ListHeader
uniform usamplerBuffer occluded;         // R32UI: answers to shadow rays
uniform usamplerBuffer sun_occluded;     // R32UI: answers to sun rays
uniform samplerBuffer met_lamps;         // RGBA32F: MetLamp, two texels each
uniform uint depth;                      // number of this vertex, > 0

#include "shaders/lib/group_rows.glsl"
#include "shaders/lib/hit_texels.glsl"
#include "shaders/lib/ray_cone.glsl"
layout(std430) buffer PathRays { Ray path_rays[]; };
layout(std430) buffer States { PathState states[]; };
OPTIONAL(HALFLIGHT_LIGHT_SAMPLES) layout(std430) writeonly buffer ShadowRays { Ray shadow_rays[]; };
OPTIONAL(HALFLIGHT_LIGHT_SAMPLES) layout(std430) writeonly buffer Lit { uint lit[]; };
OPTIONAL(HALFLIGHT_LIGHT_SAMPLES) layout(std430) buffer LitHeader { ListHeader lit_header; };
OPTIONAL(HALFLIGHT_LIGHT_SAMPLES && HALFLIGHT_SUN) layout(std430) writeonly buffer SunRays { Ray sun_rays[]; };
OPTIONAL(HALFLIGHT_SUN && (HALFLIGHT_PENDING || HALFLIGHT_LIGHT_SAMPLES))
    layout(std430) buffer SunLight { vec4 sun_light[]; };
OPTIONAL(!HALFLIGHT_LAST_VERTEX) layout(std430) writeonly buffer Leaving { uint leaving[]; };
OPTIONAL(!HALFLIGHT_LAST_VERTEX) layout(std430) buffer LeavingHeader { ListHeader leaving_header; };
OPTIONAL(HALFLIGHT_RECEIVERS) layout(std430) buffer Receivers { Receiver receivers[]; };  // origins of the rays
OPTIONAL(HALFLIGHT_TEXTURE_LEVELS && !HALFLIGHT_LAST_VERTEX) layout(std430) buffer Cones { RayCone cones[]; };
OPTIONAL(HALFLIGHT_VOLUME && !HALFLIGHT_LAST_VERTEX) layout(std430) buffer Media { vec4 media[]; };
OPTIONAL(HALFLIGHT_LIGHT_GROUPS) layout(std430) buffer GroupLight { vec4 group_light[]; };
OPTIONAL(HALFLIGHT_REUSE) layout(std430) buffer Points { ReusePoint points[]; };
OPTIONAL(HALFLIGHT_RADIANCE_CACHE) layout(std430) buffer Points { CachePoint cache_points[]; };
OPTIONAL(HALFLIGHT_CACHE_ASKED) layout(std430) buffer Cells { CacheCell cells[]; };

#include "shaders/lib/dimensions.glsl"
#include "shaders/lib/next_event.glsl"
#include "shaders/lib/occlusion.glsl"
#include "shaders/lib/path_list.glsl"
#include "shaders/lib/cache_lookup.glsl"
#include "shaders/lib/sun_light.glsl"
#include "shaders/lib/surface_record.glsl"

#if HALFLIGHT_LIGHT_SAMPLES
DEFINE_APPEND(append_lit, lit_header)
#else
uint append_lit(bool wanted) { return 0u; }
#endif
#if HALFLIGHT_LAST_VERTEX
uint append_leaving(bool wanted) { return 0u; }
#else
DEFINE_APPEND(append_leaving, leaving_header)
#endif

// --- The vertex ------------------------------------------------------------------------------------------------------

// The surface or the light that the path's ray has met.
struct PathVertex {
    uint path;
    bool is_active;  // false: the invocation is beyond the list's end, and must store nothing
    bool is_hit;     // the ray has met a surface, else the environment
    Ray ray;
    vec3 direction;  // direction of the ray, unit length
    float distance;  // from the ray's origin
    Hit hit;
    SurfacePoint at;
    vec3 geometric_normal;
    vec4 medium;     // medium of the ray (medium_towards())
    Sampler random;
};

PathVertex load_vertex(uint entry) {
    PathVertex v;
    v.is_active = entry < texelFetch(arriving_header, 0).w;
    v.path = texelFetch(arriving, int(v.is_active ? entry : 0u)).x;
    v.ray = path_rays[v.path];
    v.direction = normalize(v.ray.direction);
    v.hit = load_hit(v.path);
    v.distance = v.hit.t * length(v.ray.direction);
    v.at = load_surface_point(v.path);
    v.is_hit = v.at.is_surface;
    // A miss looks up triangle 0, too, because the lanes of a register cannot diverge. The result is not used.
    v.hit.triangle = v.is_hit ? v.hit.triangle : 0u;
    v.hit.instance = v.is_hit ? v.hit.instance : 0u;
    v.geometric_normal = load_geometric_normal(v.path);
    v.medium = kVolume && !kLastVertex ? media[v.path] : vec4(0.0);
    v.random = path_sampler(frame, v.path);
    return v;
}

// The path's point. Without kPoints, there is none.
struct PathPoint {
    bool exists;
    // The path has left vertex 1 diffusely: what it finds from then on reaches vertex 1 as diffuse light, so the point
    // takes it, and each receiver of the group multiplies it by its own BSDF.
    bool takes_rest;
    bool takes_diffuse;  // at vertex 1: diffuse light is no part of the path's own light
    bool is_known;       // at vertex 1: a cell has this light already, so that the path need not go on to find it
    vec3 light;
    vec3 pending;        // light of the light sample
    vec3 sun;            // light of the sun sample
};

PathPoint load_point(uint path, PathState state) {
    PathPoint point = PathPoint(false, false, false, false, vec3(0.0), vec3(0.0), vec3(0.0));
    if (kPoints && !kFirstHit) {
        point.exists = (state.reuse & kReusePoint) != 0u;
        point.takes_rest = (state.reuse & kReuseRest) != 0u;
        point.light = kReuse ? points[path].light : cache_points[path].light;
        point.pending = kReuse ? points[path].pending : cache_points[path].pending;
        point.sun = kSun && kPending ? sun_light[given_sun_light(path)].rgb : vec3(0.0);
    }
    return point;
}

// Adds light to a group. first: kOwnGroups or kGivenGroups.
void add_to_group(uint path, uint first, uint group, vec3 light) {
    if (contributes(light)) group_light[path * kGroupRows + first + group].rgb += light;
}

// --- Light that has arrived ------------------------------------------------------------------------------------------

// Adds the light of one sample, given the answer to its shadow ray. own, given: light of the path and of its point.
void add_answer(PathVertex v, uint answer, uint group, vec3 own, vec3 given, inout PathState state,
                inout PathPoint point) {
    own = answered_light(own, answer);
    state.indirect += own;
    if (kPoints) {
        given = answered_light(given, answer);
        point.light += given;
    }
    if (kLightGroups > 0u && v.is_active) {
        add_to_group(v.path, kOwnGroups, group, own);
        if (kReuse) add_to_group(v.path, kGivenGroups, group, given);
    }
}

// Adds the light that the last vertex sampled, as far as nothing was in between.
void add_sampled_light(PathVertex v, inout PathState state, inout PathPoint point) {
    if (kPending && state.pending_light != 0u) {
        uint group = kLightGroups > 0u ? word_of_float(group_light[v.path * kGroupRows].y) : 0u;
        add_answer(v, texelFetch(occluded, int(v.path)).x, group, state.pending, point.pending, state, point);
        if (kSun) {
            group = kLightGroups > 0u ? sun_group() : 0u;
            vec3 sun = sun_light[own_sun_light(v.path)].rgb;
            add_answer(v, texelFetch(sun_occluded, int(v.path)).x, group, sun, point.sun, state, point);
        }
    }
    state.pending_light = 0u;
    point.pending = vec3(0.0);
}

float largest(vec3 light) { return max(light.r, max(light.g, light.b)); }

// Keeps the light `met` behind the lamp that the path has met, or that of the lamp, in proportion, because the light
// met at a vertex has one group. Returns whether it is the lamp's.
bool choose_met(PathVertex v, inout vec3 met) {
    vec3 of_lamp = texelFetch(met_lamps, 2 * int(v.path)).rgb;
    float number = sample_1d(v.random, vertex_dimension(depth, kDimensionLobe) + kDimensionsOfSizes);
    float of_both = largest(met) + largest(of_lamp);
    bool is_lamp = contributes(of_lamp) && !any(isnan(met)) && !(number * of_both < largest(met));
    float of_kept = is_lamp ? largest(of_lamp) : largest(met);
    met = (is_lamp ? of_lamp : met) * (of_kept > 0.0 && of_kept < of_both ? of_both / of_kept : 1.0);
    return is_lamp;
}

// Adds the light that the ray has met. Light samples of the last vertex could have found it, too, so it has the weight
// of multiple importance sampling (power heuristic). state.pdf is the density of the ray's direction in the component
// that was picked, times the probability of that component; 0: a mirror's, which light samples cannot find.
void add_met_light(PathVertex v, inout PathState state, inout PathPoint point) {
    Receiver from = receiver_at(vec3(0.0), vec3(0.0));  // any receiver will do
    if (kReceivers) from = receivers[v.path];
    float density = v.is_hit ? light_pdf(from, v.hit, v.direction, v.distance, v.geometric_normal)
                             : environment_pdf(from, v.direction);
    if (kFirstHit) density *= float(HALFLIGHT_SHADOW_RAYS);  // event_of() has the same factor
    vec3 met = v.at.emission * (state.throughput * met_light_weight(state.pdf, density));
    if (kLightLinks) {
        uint link_set = link_set_entry(entry_of_met(v.hit, v.is_hit));
        bool left_out = !lights_receiver(link_set, from) || (sampled_alone(link_set) && v.ray.t_min == 0.0);
        met = left_out ? vec3(0.0) : met;
    }
    bool is_lamp = kSizedLights && choose_met(v, met);
    if (kLightGroups > 0u) {
        uint group = group_of_met(v.hit, v.is_hit);
        if (is_lamp) group = word_of_float(texelFetch(met_lamps, 2 * int(v.path) + 1).x);
        if (kFirstHit && v.is_active) group_light[v.path * kGroupRows].x = float_of_word(group);
        if (!kFirstHit && v.is_active) add_to_group(v.path, point.takes_rest ? kGivenGroups : kOwnGroups, group, met);
    }
    if (kFirstHit) {
        state.direct = met;
    } else if (kPoints) {
        point.light += point.takes_rest ? met : vec3(0.0);
        state.indirect += point.takes_rest ? vec3(0.0) : met;
        if (v.is_active && point.exists && kReuse) points[v.path].light = point.light;
        if (v.is_active && point.exists && kCache) cache_points[v.path].light = point.light;
    } else {
        state.indirect += met;
    }
}

// --- Cells and points ------------------------------------------------------------------------------------------------

// Cells in which the vertex lies.
struct VertexCells {
    int finest;
    int levels;
    bool usable;  // cells may hold light of the vertex
};

VertexCells cells_of(PathVertex v, Bsdf b, PathState state) {
    VertexCells c = VertexCells(0, 0, false);
    if (kAsksCells || kTakesCells) {
        c.finest = cache_level(distance(v.at.position, frame.camera_position.xyz));
        c.levels = cache_levels(c.finest, v.distance, state.pdf, -dot(v.geometric_normal, v.direction));
        c.usable = v.is_active && v.is_hit && state.pdf > 0.0 && c.levels > 0 && contributes(b.diffuse);
        // Cells hold the light on one side.
        if (kDiffuseTransmission) c.usable = c.usable && !contributes(b.diffuse_through);
    }
    return c;
}

// Adds the diffuse light of a known cell, in the place of the path's own.
void take_light_of_cell(PathVertex v, VertexCells c, PathPoint point, inout PathState state, inout Bsdf b) {
    uint known = c.usable && !point.takes_rest
                     ? known_cell(v.at.position, v.geometric_normal, v.at.link_class, c.finest, c.levels)
                     : kNoCacheCell;
    vec3 from_cell = cache_mean(known == kNoCacheCell ? 0u : known);
    state.indirect += known != kNoCacheCell ? state.throughput * b.diffuse * from_cell : vec3(0.0);
    b.diffuse = known != kNoCacheCell ? vec3(0.0) : b.diffuse;
}

// Begins the point of vertex 1. stored: the record for cells, not set with path reuse. Cells hold the light of albedo
// 1, which `b` gets.
void begin_point(PathVertex v, VertexCells c, PathState state, inout Bsdf b, inout PathPoint point,
                 out CachePoint stored) {
    if (kReuse) {  // shaders/resolve.comp has stored the point, all but its light
        point.exists = v.is_hit && state.pdf > 0.0 && points[v.path].share > 0.0;
        if (HALFLIGHT_PANES != 0) point.exists = point.exists && (state.reuse & kReuseThroughPane) == 0u;
        point.takes_diffuse = point.exists;
    } else {
        stored = cache_point(c.levels, state.throughput * b.diffuse);
        point.takes_diffuse = c.usable;
        float to_feed = sample_1d(v.random, vertex_dimension(depth, kDimensionRoulette));
        point.is_known = c.usable && find_cells(v.at.position, v.geometric_normal, v.at.link_class, c.finest, to_feed,
                                                stored);
        point.exists = c.usable && !point.is_known;
        b.diffuse = c.usable ? vec3(1.0) : b.diffuse;
    }
}

// Stores what the light sample gives to the point.
void store_pending(PathVertex v, PathPoint point, CachePoint stored) {
    if (v.is_active && point.exists && kReuse) points[v.path].pending = point.pending;
    if (v.is_active && point.exists && kCache && !kFirstHit) cache_points[v.path].pending = point.pending;
    if (v.is_active && point.takes_diffuse && kAsksCells) {
        stored.pending = point.pending;
        cache_points[v.path] = stored;
    }
}

// --- Next-event estimation -------------------------------------------------------------------------------------------

// Splits the light of a sample into that of the path and that of its point. Returns whether there is any.
bool split_light(NextEvent e, vec3 throughput, PathPoint point, out vec3 own, out vec3 given) {
    given = kMakesPoint && point.exists ? e.diffuse : vec3(0.0);
    if (kMakesPoint && point.takes_diffuse) e.diffuse = vec3(0.0);
    own = throughput * (e.diffuse + e.glossy);
    bool any_light = contributes(own) || (kMakesPoint && contributes(given));
    if (kPoints && !kFirstHit) {
        given = point.takes_rest ? own : vec3(0.0);
        own = point.takes_rest ? vec3(0.0) : own;
    }
    return any_light;
}

// Light samples of the vertex. Their light waits for the answers to shadow rays (add_sampled_light() of the next
// vertex). event_of() in shaders/lib/next_event.glsl gives them the weights of multiple importance sampling.
struct LightSamples {
    bool is_lit;   // any light may arrive
    Ray ray;
    uint group;    // light group
    Ray sun_ray;
    vec3 sun;      // light of the sun sample that is the path's own
};

LightSamples sample_lights(PathVertex v, Bsdf b, inout PathState state, inout PathPoint point) {
    LightSamples samples;
    uint dimension = vertex_dimension(depth, kDimensionLight);
    Receiver at = receiver_at(v.at.position, b.geometric_normal, v.at.link_class);
    NextEvent e = sample_next_event(at, v.at.offset, b, -v.direction, v.medium, v.random, dimension, 1u);
    bool asks = split_light(e, state.throughput, point, state.pending, point.pending);
    if (kSun) {
        NextEvent sun = sample_sun_event(at, v.at.offset, b, -v.direction, v.medium, v.random, dimension);
        bool asks_sun = split_light(sun, state.throughput, point, samples.sun, point.sun);
        if (!asks) e.ray = kDeadRay;
        if (!asks_sun) sun.ray = kDeadRay;
        samples.sun_ray = sun.ray;
        asks = asks || asks_sun;
    }
    samples.is_lit = v.is_active && v.is_hit && asks;
    samples.ray = e.ray;
    samples.group = e.group;
    state.pending_light = samples.is_lit ? 1u : 0u;
    return samples;
}

void send_shadow_rays(PathVertex v, LightSamples samples, PathPoint point) {
    uint place = append_lit(samples.is_lit);
    if (samples.is_lit) {
        lit[place] = v.path;
        shadow_rays[v.path] = samples.ray;
        if (kLightGroups > 0u) group_light[v.path * kGroupRows].y = float_of_word(samples.group);
        if (kSun) {
            sun_rays[v.path] = samples.sun_ray;
            sun_light[own_sun_light(v.path)] = vec4(samples.sun, 0.0);
            if (kPoints) sun_light[given_sun_light(v.path)] = vec4(point.sun, 0.0);
        }
    }
}

// --- The next ray ----------------------------------------------------------------------------------------------------

// Samples a direction of the component that was picked; weight: f cos / pdf. It computes both components and selects,
// because the lanes of a register take all branches anyway.
BsdfSample sample_component(Bsdf b, bool is_diffuse, vec3 wo, vec2 xi, float choice) {
    if (!kDiffuse) return sample_glossy(b, wo, xi, choice);
    BsdfSample s = sample_diffuse(b, wo, xi, choice);
    if (kGlossy) {
        BsdfSample glossy = sample_glossy(b, wo, xi, choice);
        s.direction = is_diffuse ? s.direction : glossy.direction;
        s.weight = is_diffuse ? s.weight : glossy.weight;
        s.pdf = is_diffuse ? s.pdf : glossy.pdf;
    }
    return s;
}

// Samples the BSDF for the next ray, and updates throughput and density. Returns whether the path goes on.
bool scatter(PathVertex v, Bsdf b, inout PathState state, PathPoint point, out BsdfSample s) {
    vec2 choice = sample_2d(v.random, vertex_dimension(depth, kDimensionLobe));
    vec2 xi = sample_2d(v.random, vertex_dimension(depth, kDimensionDirection));
    bool is_diffuse = picks_diffuse(b, choice.x);
    s = sample_component(b, is_diffuse, -v.direction, xi, choice.y);
    if (kMakesPoint) {
        bool takes_rest = point.exists && is_diffuse;
        state.throughput = takes_rest ? vec3(1.0) : state.throughput;  // each receiver has its own BSDF
        state.reuse = (point.exists ? kReusePoint : 0u) | (takes_rest ? kReuseRest : 0u);
        if (kCache) state.reuse |= point.takes_diffuse ? kReuseCell : 0u;
    }
    float p = is_diffuse ? b.p_diffuse : 1.0 - b.p_diffuse;
    state.throughput *= s.weight / p;
    state.pdf = p * s.pdf;
    bool goes_on = v.is_active && v.is_hit && contributes(state.throughput) && !(point.is_known && is_diffuse);
    // Roulette would end a path with NaN throughput unnoticed. Here the path ends where it is counted.
    if (goes_on && !all_finite(state.throughput)) {
        state.indirect = state.throughput;
        goes_on = false;
    }
    return goes_on;
}

// Plays Russian roulette from depth 3 on. Returns whether the path survives. `depth` is a uniform here, because another
// variant costs more to compile than it saves; main() leaves roulette out of the first vertex, which has a variant.
bool survives_roulette(PathVertex v, inout PathState state) {
    float survival = min(largest(state.throughput), 0.95);
    bool survives = sample_1d(v.random, vertex_dimension(depth, kDimensionRoulette)) < survival;
    state.throughput = depth < 3u ? state.throughput : state.throughput / survival;
    return depth < 3u || survives;
}

// Sends the next ray if the path goes on.
void send_ray(PathVertex v, bool goes_on, Bsdf b, BsdfSample s, float pdf) {
    uint place = append_leaving(goes_on);
    if (!goes_on) return;
    leaving[place] = v.path;
    const bool kMarks = HALFLIGHT_BACKFACES != 0 || kShadowLinks;
    bool marked = kMarks && v.ray.t_min > 0.0 && pdf == 0.0;
    path_rays[v.path] = ray_from(v.at.position, v.at.offset, b.geometric_normal, s.direction, marked);
    if (kTextureLevels) cones[v.path] = scattered_cone(cones[v.path], v.distance, s.pdf);
    if (kVolume) media[v.path] = medium_towards(b, v.medium, s.direction);
    if (kReceivers) receivers[v.path] = receiver_at(v.at.position, b.geometric_normal, v.at.link_class);
}

// Stores what this vertex may have changed. Stores cost more than anything else here.
void store_state(uint path, PathState state) {
    if (kFirstHit) {
        states[path].direct = state.direct;
        states[path].reuse = state.reuse;
    }
    states[path].indirect = state.indirect;
    states[path].pending_light = state.pending_light;
    if (!kLastVertex) {
        states[path].throughput = state.throughput;
        states[path].pdf = state.pdf;
        states[path].pending = state.pending;
    }
}

void main() {
    PathVertex v = load_vertex(gl_GlobalInvocationID.x);
    PathState state = states[v.path];
    PathPoint point = load_point(v.path, state);
    if (kLightGroups > 0u && kFirstHit && v.is_active)
        for (uint i = 1u; i < kGroupRows; ++i) group_light[v.path * kGroupRows + i] = vec4(0.0);

    add_sampled_light(v, state, point);
    add_met_light(v, state, point);
    if (!kLastVertex) {
        Bsdf b = load_bsdf(v.path);
        VertexCells cells_here = cells_of(v, b, state);
        CachePoint stored;
        if (kTakesCells) take_light_of_cell(v, cells_here, point, state, b);
        if (kMakesPoint) begin_point(v, cells_here, state, b, point, stored);

        LightSamples samples;
        if (kLightSamples) samples = sample_lights(v, b, state, point);
        BsdfSample s;
        bool goes_on = scatter(v, b, state, point, s);
        if (!kFirstHit) {
            bool survives = survives_roulette(v, state);
            goes_on = goes_on && survives;
        }
        if (kLightSamples) send_shadow_rays(v, samples, point);
        send_ray(v, goes_on, b, s, state.pdf);
        store_pending(v, point, stored);
    }
    if (v.is_active) store_state(v.path, state);
}
