// Resolves hits: stores a surface record (shaders/shared/surface_rows.h) for the hit of each path's ray, or for the
// environment if it is a miss. No other kernel of a frame makes records or looks up the geometry of a hit.
#include "shaders/shared/frame_block.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/shared/reuse_groups.h"
#include "shaders/geometry_tables.glsl"
#include "shaders/scene_tables.glsl"

layout(local_size_x = 64) in;

// Source of the hits: the listed paths' rays, all paths' rays, or the visibility buffer.
const bool kList = HALFLIGHT_LIST != 0;
const bool kTraced = kList || HALFLIGHT_TRACED != 0;
// The scene's tables hold the rows of these hits, in the order of the invocations (engine/paging/row_gather.h).
const bool kGatheredRows = HALFLIGHT_GATHERED_ROWS != 0;

// These are stored instead of whole records:
const bool kSeen = HALFLIGHT_SEEN != 0;               // the emission, added to a mean and to that of its light group
const bool kLastVertex = HALFLIGHT_LAST_VERTEX != 0;  // emission and geometric normal only
// These are stored in addition:
const bool kReusePoints = HALFLIGHT_REUSE_POINTS != 0;  // the point for path reuse, without its light
const bool kStoreRays = HALFLIGHT_STORE_RAYS != 0;      // rays and hits of the visibility buffer
const bool kStoreHits = HALFLIGHT_STORE_HITS != 0;

const bool kByChance = HALFLIGHT_BY_CHANCE != 0;  // rays have met panes by chance (shaders/panes.comp)
const bool kCatchers = HALFLIGHT_CATCHERS != 0 && !kList;  // the camera may see shadow catchers
// Lookups choose mip levels by the width of the ray's cone.
#define HALFLIGHT_CHOOSE_LEVELS HALFLIGHT_TEXTURE_LEVELS

layout(std140) uniform FrameBlock { Frame frame; };
uniform usamplerBuffer list;    // R32UI: path indices
uniform usamplerBuffer header;  // RGBA32UI: ListHeader
uniform samplerBuffer cones;    // RG32F: RayCone of each path
uniform samplerBuffer media;    // RGBA32F: medium of each path's ray (shaders/lib/medium.glsl)
uniform usamplerBuffer state_texels;  // RGBA32UI: PathState of each path
layout(rg32ui) readonly uniform uimage2D visibility;
uniform uint again_count;  // number of `invocations_again`; 0: all invocations run
uniform float weight;      // weight of the rays in the mean
uniform bool begins;       // true: the mean is empty so far

// Invocations that miss tiles of textures request them and store nothing. They go into a list, and run again when the
// tiles are there (engine/paging/tile_pool.h).
OPTIONAL(HALFLIGHT_TILE_REQUESTS)
    layout(std430) buffer TileRequests { uint requested_count; uint waiting_count; uint requested_tiles[]; };
OPTIONAL(HALFLIGHT_TILE_REQUESTS) layout(std430) buffer TileBits { uint requested_bits[]; };  // one bit per tile
OPTIONAL(HALFLIGHT_TILE_REQUESTS)
    layout(std430) writeonly buffer TileWaiting { uvec2 waiting[]; };  // invocation, a tile that it misses
OPTIONAL(HALFLIGHT_TILE_REQUESTS)
    layout(std430) readonly buffer TileAgain { uint invocations_again[]; };  // invocations of this run
OPTIONAL(HALFLIGHT_STORE_RAYS) layout(std430) writeonly buffer Rays { Ray stored_rays[]; };
OPTIONAL(HALFLIGHT_STORE_HITS) layout(std430) writeonly buffer Hits { Hit stored_hits[]; };
OPTIONAL(HALFLIGHT_SEEN) layout(std430) buffer LightSeen { vec4 light_seen[]; };
OPTIONAL(!HALFLIGHT_SEEN) layout(std430) writeonly buffer Surfaces { vec4 records[]; };
OPTIONAL(HALFLIGHT_REUSE_POINTS) layout(std430) writeonly buffer Points { ReusePoint points[]; };

#include "shaders/lib/alpha_sampler.glsl"
#include "shaders/lib/camera.glsl"
#include "shaders/lib/dimensions.glsl"
#include "shaders/lib/environment.glsl"
#include "shaders/lib/finite.glsl"
#include "shaders/lib/hit_texels.glsl"
#include "shaders/lib/light_of_hit.glsl"
#include "shaders/lib/material.glsl"
#include "shaders/lib/path_pixel.glsl"
#include "shaders/lib/panes.glsl"
#include "shaders/lib/primary_search.glsl"
#include "shaders/lib/ray_cone.glsl"
#include "shaders/lib/ray_texels.glsl"
#include "shaders/lib/reuse.glsl"
#include "shaders/lib/surface_record.glsl"

// --- The hit ---------------------------------------------------------------------------------------------------------

struct Found {
    uint path;
    bool stores;      // false: the invocation is beyond the list's end, or waits for tiles
    bool inside;      // the pixel is in the picture
    Ray ray;
    vec3 direction;   // direction of the ray, unit length
    Hit hit;          // a miss has triangle 0, whose surface is not used: the lanes of a register cannot diverge
    bool is_hit;
    bool unfinished;  // the driver stopped the traversal
    uint group;       // kSeen: light group of what is seen
};

// Returns whether a ray from the camera has met a shadow catcher.
bool met_catcher(Hit hit, bool is_hit) { return kCatchers && is_hit && catches_shadows(hit.triangle); }

Found find_hit(uint invocation, bool runs) {
    Found f;
    ivec2 pixel = ivec2(0);
    if (kList) {
        f.stores = runs && invocation < texelFetch(header, 0).w;
        f.path = texelFetch(list, int(f.stores ? invocation : 0u)).x;
        f.inside = true;
    } else {
        f.stores = runs;
        f.path = invocation;
        pixel = ivec2(pixel_in_band(frame, f.path));
        f.inside = pixel.x < frame.band_columns && pixel.y < frame.band_rows;
    }
    if (kTraced) {
        f.ray = load_ray(f.path);
        f.hit = load_hit(f.path);
        f.is_hit = f.hit.triangle != kMiss && finite(f.hit.t);
        f.unfinished = f.hit.triangle != kMiss && !f.is_hit;
        f.hit.triangle = f.is_hit ? f.hit.triangle : 0u;
        f.hit.instance = f.is_hit ? f.hit.instance : 0u;
    } else {
        // Invocations beyond the band's edge look up the last pixel again, and do not use the result.
        pixel = min(pixel, ivec2(frame.band_columns, frame.band_rows) - 1) + ivec2(frame.band_x, frame.band_y);
        f.ray = camera_ray(frame, pixel);
        PrimarySearch seen = search_seen(frame, pixel, f.ray, alpha_sampler_of_pixel(frame, uvec2(pixel), 0u));
        f.hit = seen.hit;
        f.is_hit = f.inside && seen.is_hit && f.hit.t <= f.ray.t_max;
        f.unfinished = false;
    }
    f.direction = kList ? normalize(f.ray.direction) : f.ray.direction;
    f.group = 0u;
    if (kSeen && kLightGroups > 0u) f.group = group_of_met(f.hit, f.is_hit && !met_catcher(f.hit, f.is_hit));
    if (kTraced && kGatheredRows) f.hit.triangle = f.stores ? invocation : 0u;
    return f;
}

// --- Material and light ----------------------------------------------------------------------------------------------

// Returns the area that a cone of this width covers in both sets of texture coordinates. cosine: at the hit.
vec2 footprint_at(Hit hit, float width, float cosine) {
    uvec3 corners = triangle_corners(hit.triangle);
    vec3 a = block_to_world(hit.instance, corner_position(corners.x));
    vec3 ab = block_to_world(hit.instance, corner_position(corners.y)) - a;
    vec3 ac = block_to_world(hit.instance, corner_position(corners.z)) - a;
    vec4 first = corner_uvs(corners.x);
    vec4 s = corner_uvs(corners.y) - first;
    vec4 t = corner_uvs(corners.z) - first;
    vec2 doubled_uv_areas = abs(s.xz * t.yw - s.yw * t.xz);
    vec3 reach = max(abs(ab), abs(ac));
    float size = max(reach.x, max(reach.y, reach.z));  // keeps squares of small and large lengths finite
    float doubled_area = length(cross(ab / size, ac / size));
    float share = width / size;
    return doubled_uv_areas * (share * (share / (doubled_area * max(cosine, 1.0 / 64.0))));
}

// Sets the footprint of texture lookups.
void choose_levels(Found f, Surface surface) {
    RayCone cone = camera_cone(frame);
    if (kList) {
        vec2 of_path = texelFetch(cones, int(f.path)).xy;
        cone = RayCone(of_path.x, of_path.y);
    }
    float width = cone_width(cone, f.hit.t * length(f.ray.direction));
    uv_footprint = footprint_at(f.hit, width, -dot(surface.geometric_normal, f.direction));
    // The chance of a pane was that of level 0.
    if (kByChance && in_pane(triangle_row(f.hit.triangle).w)) uv_footprint = vec2(0.0);
}

// Returns whether the hit is a pane that the ray has met instead of passing it.
bool met_by_chance(Found f) {
    bool met = kByChance && f.is_hit && in_pane(triangle_row(f.hit.triangle).w);
    if (kByChance && kSolidPanes) met = met && (texelFetch(state_texels, int(4u * f.path + 3u)).w & kReuseMetByChance) != 0u;
    return met;
}

// Lets the invocation wait for tiles that it misses. Returns whether it misses any.
bool waits_for_tiles(uint invocation) {
#if HALFLIGHT_TILE_REQUESTS
    if (missing_tile != kNoTile) waiting[atomicAdd(waiting_count, 1u)] = uvec2(invocation, missing_tile);
#endif
    return missing_tile != kNoTile;
}

// Returns the light that the ray meets.
vec3 met_emission(Found f, Material material, bool shown) {
    bool sees_environment = kList || (f.inside && f.ray.t_max >= 0.0 && frame.transparent == 0u);  // a dead ray sees none
    vec3 emission = shown ? material.emission : sees_environment ? environment_radiance(f.direction) : vec3(0.0);
    if (f.unfinished) emission = vec3(not_a_number());  // the NaN is counted later
    return emission;
}

// --- Results ---------------------------------------------------------------------------------------------------------

// Adds emission to the mean, and to its part by light group.
void add_seen(Found f, vec3 emission) {
    const uint rows = 1u + kLightGroups;
    for (uint i = 0u; i < rows; ++i) {
        vec4 before = begins ? vec4(0.0) : light_seen[f.path * rows + i];
        vec4 more = i == 0u || i == 1u + f.group ? weight * vec4(emission, 0.0) : vec4(0.0);
        if (f.stores) light_seen[f.path * rows + i] = before + more;
    }
}

// Stores the part of a record that the last vertex of a path needs.
void store_end(uint path, vec3 emission, bool is_surface, vec3 geometric_normal) {
    uint row = path * HALFLIGHT_SURFACE_ROWS;
    records[row + 1u] = vec4(emission, is_surface ? 0.0 : -1.0);
    records[row + 2u] = vec4(geometric_normal, 0.0);
}

void store_surface(uint path, SurfacePoint point, Bsdf b) {
    uint row = path * HALFLIGHT_SURFACE_ROWS;
    records[row] = vec4(point.position, point.offset);
    records[row + 1u] = vec4(point.emission, point.is_surface ? point.lift : point.catches ? -2.0 : -1.0);
    vec4 rows[kBsdfRows] = pack_bsdf(b);
    for (uint i = 0u; i < kBsdfRows; ++i) records[row + 2u + i] = rows[i];
    if (kLightLinks) records[row + kLinkRow] = vec4(float_of_word(point.link_class), 0.0, 0.0, 0.0);
}

// Returns the second vertex of a path as a point to be shared, all but its light. A point that cannot be shared has a
// share of 0.
ReusePoint reuse_point(Surface surface, Material m, Bsdf b, Ray ray, float t) {
    ReusePoint y;
    y.position = surface.position;
    y.offset = surface.offset;
    y.geometric_normal = surface.geometric_normal;
    y.distance = t;
    y.direction = ray.direction;
    y.light = vec3(0.0);
    y.reserved0 = 0.0;
    y.pending = vec3(0.0);
    y.reserved1 = 0.0;
    Layers layers = layers_of(m, b.geometric_normal);
    y.layers = pack_layers(layers);
    // A bent normal makes the diffuse lobe depend on wo. Edge-on or at distance 0, the point has no density per area.
    bool sharable = !m.bent && b.diffuse + b.diffuse_through != vec3(0.0) &&
                    dot(y.geometric_normal, ray.direction) < 0.0 && t > 1e-18;
    y.share = sharable ? base_share(layers, -ray.direction) : 0.0;
    return y;
}

// Makes and stores the record, and the point for path reuse. medium, way: of the ray.
void resolve_surface(Found f, Surface surface, Material material, vec3 emission, bool shown, bool catches, bool met_pane,
                     vec4 medium, float way) {
    if (kDispersion) {
        float pick = sample_1d(path_sampler(frame, f.path), vertex_dimension(0u, kDimensionRoulette));  // no roulette there
        material.channel = min(int(3.0 * pick), 2);
    }
    // Rays from opaque surfaces start at the smooth surface, which takes the place of the triangle (SHADING.md, Shading
    // normals). Lights stay where they are hit.
    vec3 smooth_normal = bend_normal(surface.smooth_normal, -f.direction);
    float passing = (material.transmission + material.diffuse_transmission) * (1.0 - material.metallic);
    bool lifted = passing == 0.0 && material.emission == vec3(0.0) &&
                  surface.lift * dot(smooth_normal, surface.geometric_normal) > surface.offset;
    float lift = lifted ? surface.lift : 0.0;
    vec3 horizon = lifted ? smooth_normal : surface.geometric_normal;
    vec3 origin = surface.position + lift * horizon;
    Bsdf b = make_bsdf(material, horizon, -f.direction);
    bool one_channel = false;
    if (met_pane) emission *= make_met_pane(b, -f.direction);
    if (kVolume) {
        vec3 light = vec3(1.0);
        if (kDispersion && b.disperses) light = dispersed_light(medium, material.channel);
        one_channel = is_one_channel(medium);
        // A ray from inside, whatever its origin knew. Those that meet panes by chance come from outside.
        if (b.thickness < 0.0 && !met_pane) medium = vec4(b.absorption, -b.thickness);
        scale_lobes(b, light * transmittance(medium, way));
    }
    if (catches) make_catcher(b);
    uint link_class = class_of_object(f.hit.triangle, f.hit.instance);
    if (f.stores)
        store_surface(f.path, SurfacePoint(origin, surface.offset, lift, emission, shown, catches, link_class), b);
    if (kReusePoints) {
        if (lifted && dot(surface.smooth_normal, f.direction) >= 0.0) material.bent = true;  // the horizon depends on wo
        ReusePoint point = reuse_point(surface, material, b, f.ray, f.hit.t);
        if (met_pane) point.share = 0.0;  // other receivers would have met it by another chance
        if (kVolume && (medium.w > 0.0 || one_channel)) point.share = 0.0;  // light inside of solids, or of one channel
        if (f.stores && f.is_hit) points[f.path] = point;
    }
}

void main() {
    uint invocation = gl_GlobalInvocationID.x;
    bool runs = true;
    if (kTileRequests) {
        runs = again_count == 0u || invocation < again_count;
        if (again_count > 0u) invocation = invocations_again[min(invocation, again_count - 1u)];
    }
    Found f = find_hit(invocation, runs);
    Surface surface = surface_at(f.hit, f.ray.direction);
    if (kTextureLevels) choose_levels(f, surface);
    tiles_wanted = f.stores && f.is_hit;
    Material material = evaluate_material(surface, -f.direction);
    if (kTileRequests && waits_for_tiles(invocation)) f.stores = false;
    bool catches = met_catcher(f.hit, f.is_hit);
    bool shown = f.is_hit && !catches;
    bool met_pane = met_by_chance(f);
    vec3 emission = met_emission(f, material, shown);
    if (kLastVertex && kByChance) {
        material.channel = 0;  // panes do not disperse
        Bsdf of_pane = make_bsdf(material, surface.geometric_normal, -f.direction);
        if (met_pane) emission *= make_met_pane(of_pane, -f.direction);
    }
    // The ray's medium is that of its origin for emitted light, like that of light samples.
    vec4 medium = kVolume && kList ? texelFetch(media, int(f.path)) : vec4(0.0);
    float way = f.is_hit ? f.hit.t * length(f.ray.direction) : endless_way(medium);
    if (kVolume && !kSeen) emission *= transmittance(medium, way);

    if (kSeen) add_seen(f, emission);
    else if (!kLastVertex) resolve_surface(f, surface, material, emission, shown, catches, met_pane, medium, way);
    else if (f.stores) store_end(f.path, emission, f.is_hit, surface.geometric_normal);

    if (kStoreRays) {
        f.ray.t_max = f.inside ? f.ray.t_max : -1.0;
        stored_rays[f.path] = f.ray;
    }
    if (kStoreHits) {
        f.hit.triangle = f.is_hit ? f.hit.triangle : kMiss;
        stored_hits[f.path] = f.hit;
    }
}
