// Resolves hits: stores a surface record (shaders/shared/surface_rows.h) for the hit of each path's ray, or for the
// environment if it is a miss. No other kernel of a frame makes records or looks up the geometry of a hit.
//
// Variants by the source of the hits:
//   HALFLIGHT_LIST           rays and hits of the listed paths
//   HALFLIGHT_TRACED         rays and hits of all paths
//   otherwise                the visibility buffer; HALFLIGHT_STORE_RAYS and HALFLIGHT_STORE_HITS store rays and hits, too
// HALFLIGHT_GATHERED_ROWS: the scene's tables hold the rows of these hits, in the order of the invocations
// (engine/paging/row_gather.h).
// HALFLIGHT_TILE_REQUESTS: invocations that miss tiles of textures request them and store nothing. They go into a list,
// and run again when the tiles are there (engine/paging/tile_pool.h).
// HALFLIGHT_TEXTURE_LEVELS: lookups choose mip levels by the width of the ray's cone.
// Variants by what is stored:
//   HALFLIGHT_SEEN           instead of a record, the emission is added to a mean, and to that of its light group
//   HALFLIGHT_LAST_VERTEX    only emission and geometric normal are stored
//   HALFLIGHT_BY_CHANCE      rays have met panes by chance (shaders/panes.comp)
//   HALFLIGHT_REUSE_POINTS   the point for path reuse is stored, too, without its light
#include "shaders/shared/frame_block.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/shared/reuse_groups.h"
#include "shaders/geometry_tables.glsl"
#include "shaders/scene_tables.glsl"

layout(local_size_x = 64) in;

layout(std140) uniform FrameBlock { Frame frame; };
#if HALFLIGHT_TILE_REQUESTS
layout(std430) buffer TileRequests { uint requested_count; uint waiting_count; uint requested_tiles[]; };
layout(std430) buffer TileBits { uint requested_bits[]; };                 // one bit per tile
layout(std430) writeonly buffer TileWaiting { uvec2 waiting[]; };          // invocation, a tile that it misses
layout(std430) readonly buffer TileAgain { uint invocations_again[]; };    // invocations of this run
uniform uint again_count;  // number of `invocations_again`; 0: all invocations run
#endif
#define HALFLIGHT_RAYS_ARE_THERE (HALFLIGHT_TRACED || HALFLIGHT_LIST)
#define HALFLIGHT_SEEN_GROUPS (HALFLIGHT_SEEN && HALFLIGHT_LIGHT_GROUPS)
#define HALFLIGHT_STORE_SURFACE (!HALFLIGHT_SEEN)
#define HALFLIGHT_CHOOSE_LEVELS HALFLIGHT_TEXTURE_LEVELS
#if HALFLIGHT_LIST
uniform usamplerBuffer list;    // R32UI: path indices
uniform usamplerBuffer header;  // RGBA32UI: ListHeader
#endif
#if HALFLIGHT_RAYS_ARE_THERE
#include "shaders/lib/hit_texels.glsl"
#include "shaders/lib/ray_texels.glsl"
#else
layout(rg32ui) readonly uniform uimage2D visibility;
#if HALFLIGHT_STORE_RAYS
layout(std430) writeonly buffer Rays { Ray rays[]; };
#endif
#if HALFLIGHT_STORE_HITS
layout(std430) writeonly buffer Hits { Hit hits[]; };
#endif
#endif
#if HALFLIGHT_SEEN
layout(std430) buffer LightSeen { vec4 light_seen[]; };

uniform float weight;  // weight of the rays in the mean
uniform bool begins;   // true: the mean is empty so far
#else
layout(std430) writeonly buffer Surfaces { vec4 surfaces[]; };
#endif
#if HALFLIGHT_REUSE_POINTS
layout(std430) writeonly buffer Points { ReusePoint points[]; };
#endif

#if HALFLIGHT_TEXTURE_LEVELS
#include "shaders/lib/ray_cone.glsl"
#if HALFLIGHT_LIST
uniform samplerBuffer cones;  // RG32F: RayCone of each path
#endif
#endif
#if HALFLIGHT_VOLUME && HALFLIGHT_LIST
uniform samplerBuffer media;  // RGBA32F: medium of each path's ray (shaders/lib/medium.glsl)
#endif
#if !HALFLIGHT_RAYS_ARE_THERE
#include "shaders/lib/alpha_key.glsl"
#include "shaders/lib/camera.glsl"
#include "shaders/lib/primary_search.glsl"
#endif
#include "shaders/lib/finite.glsl"
#if !HALFLIGHT_LIST
#include "shaders/lib/path_pixel.glsl"
#endif
#if HALFLIGHT_DISPERSION
#include "shaders/lib/dimensions.glsl"
#endif
#include "shaders/lib/material.glsl"
#if HALFLIGHT_STORE_SURFACE
#include "shaders/lib/surface_record.glsl"
#endif
#if HALFLIGHT_REUSE_POINTS
#include "shaders/lib/reuse.glsl"
#endif
#include "shaders/lib/environment.glsl"
#if HALFLIGHT_SEEN_GROUPS
#include "shaders/lib/light_of_hit.glsl"
#endif

#if HALFLIGHT_REUSE_POINTS
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
#endif

#if HALFLIGHT_CHOOSE_LEVELS
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
#endif

// Returns whether a ray from the camera has met a shadow catcher.
bool met_catcher(Hit hit, bool is_hit) {
#if HALFLIGHT_CATCHERS && !HALFLIGHT_LIST
    return is_hit && catches_shadows(hit.triangle);
#else
    return false;
#endif
}

void main() {
    uint invocation = gl_GlobalInvocationID.x;
#if HALFLIGHT_TILE_REQUESTS
    bool runs = again_count == 0u || invocation < again_count;
    if (again_count > 0u) invocation = invocations_again[min(invocation, again_count - 1u)];
#else
    const bool runs = true;
#endif
#if HALFLIGHT_LIST
    bool listed = runs && invocation < texelFetch(header, 0).w;
    uint path = texelFetch(list, int(listed ? invocation : 0u)).x;
    const bool inside = true;
#else
    bool listed = runs;
    uint path = invocation;
    ivec2 pixel = ivec2(pixel_in_band(frame, path));
    bool inside = pixel.x < frame.band_columns && pixel.y < frame.band_rows;
#endif
#if HALFLIGHT_RAYS_ARE_THERE
    Ray ray = load_ray(path);
    Hit hit = load_hit(path);
    bool is_hit = hit.triangle != kMiss && finite(hit.t);
    bool unfinished = hit.triangle != kMiss && !is_hit;
    // A miss looks up triangle 0 in vain, because the lanes of a register cannot diverge.
    hit.triangle = is_hit ? hit.triangle : 0u;
    hit.instance = is_hit ? hit.instance : 0u;
#if HALFLIGHT_SEEN_GROUPS
    uint group = group_of_met(hit, is_hit && !met_catcher(hit, is_hit));
#endif
#if HALFLIGHT_GATHERED_ROWS
    hit.triangle = listed ? invocation : 0u;
#endif
#else
    // Invocations beyond the band's edge look up the last pixel again, in vain.
    pixel = min(pixel, ivec2(frame.band_columns, frame.band_rows) - 1) + ivec2(frame.band_x, frame.band_y);
    Ray ray = camera_ray(frame, pixel);
    PrimarySearch seen = search_seen(frame, pixel, ray, alpha_key_of_pixel(frame, pixel, 0u));
    Hit hit = seen.hit;
    bool is_hit = inside && seen.is_hit && hit.t <= ray.t_max;
    const bool unfinished = false;
#if HALFLIGHT_SEEN_GROUPS
    uint group = group_of_met(hit, is_hit && !met_catcher(hit, is_hit));
#endif
#endif
#if HALFLIGHT_LIST
    vec3 direction = normalize(ray.direction);
#else
    vec3 direction = ray.direction;
#endif
    Surface surface = surface_at(hit, ray.direction);
#if HALFLIGHT_CHOOSE_LEVELS
#if HALFLIGHT_LIST
    vec2 of_path = texelFetch(cones, int(path)).xy;
    RayCone cone = RayCone(of_path.x, of_path.y);
#else
    RayCone cone = camera_cone(frame);
#endif
    float width = cone_width(cone, hit.t * length(ray.direction));
    uv_footprint = footprint_at(hit, width, -dot(surface.geometric_normal, direction));
#if HALFLIGHT_BY_CHANCE
    if (in_pane(triangle_row(hit.triangle).w)) uv_footprint = vec2(0.0);  // the chance was that of level 0
#endif
#endif
#if HALFLIGHT_TILE_REQUESTS
    tiles_wanted = listed && is_hit;
#endif
    Material material = evaluate_material(surface, -direction);
#if HALFLIGHT_TILE_REQUESTS
    if (missing_tile != kNoTile) {
        waiting[atomicAdd(waiting_count, 1u)] = uvec2(invocation, missing_tile);
        listed = false;
    }
#endif
#if HALFLIGHT_LIST
    const bool sees_environment = true;
#else
    bool sees_environment = inside && ray.t_max >= 0.0 && frame.transparent == 0u;  // not where the ray is dead
#endif
    bool catches = met_catcher(hit, is_hit);
    bool shown = is_hit && !catches;
    vec3 emission = shown ? material.emission : sees_environment ? environment_radiance(direction) : vec3(0.0);
    if (unfinished) emission = vec3(not_a_number());  // the NaN is counted later
#if HALFLIGHT_BY_CHANCE
    bool met_pane = is_hit && in_pane(triangle_row(hit.triangle).w);
#if HALFLIGHT_LAST_VERTEX
    material.channel = 0;  // panes do not disperse
    Bsdf of_pane = make_bsdf(material, surface.geometric_normal, -direction);
    if (met_pane) emission *= make_met_pane(of_pane);
#endif
#endif
#if HALFLIGHT_VOLUME && HALFLIGHT_STORE_SURFACE
    // The ray's medium is that of its origin for emitted light, like that of light samples.
#if HALFLIGHT_LIST
    vec4 medium = texelFetch(media, int(path));
#else
    vec4 medium = vec4(0.0);
#endif
    float way = is_hit ? hit.t * length(ray.direction) : endless_way(medium);
    emission *= transmittance(medium, way);
#endif
#if HALFLIGHT_SEEN
#if HALFLIGHT_SEEN_GROUPS
    const uint rows = 1u + HALFLIGHT_LIGHT_GROUPS;  // the mean, and its parts by light group
    for (uint i = 0u; i < rows; ++i) {
        vec4 before = begins ? vec4(0.0) : light_seen[path * rows + i];
        vec4 more = i == 0u || i == 1u + group ? weight * vec4(emission, 0.0) : vec4(0.0);
        if (listed) light_seen[path * rows + i] = before + more;
    }
#else
    vec4 before = begins ? vec4(0.0) : light_seen[path];
    if (listed) light_seen[path] = before + weight * vec4(emission, 0.0);
#endif
#elif HALFLIGHT_LAST_VERTEX
    if (listed) store_end(path, emission, is_hit, surface.geometric_normal);
#else
#if HALFLIGHT_DISPERSION
    float pick = sample_1d(path_sampler(frame, path), vertex_dimension(0u, kDimensionRoulette));  // no roulette there
    material.channel = min(int(3.0 * pick), 2);
#endif
    // Rays from opaque surfaces start at the smooth surface, which takes the place of the triangle (SHADING.md, Shading
    // normals). Lights stay where they are hit.
    vec3 smooth_normal = bend_normal(surface.smooth_normal, -direction);
    float passing = (material.transmission + material.diffuse_transmission) * (1.0 - material.metallic);
    bool lifted = passing == 0.0 && material.emission == vec3(0.0) &&
                  surface.lift * dot(smooth_normal, surface.geometric_normal) > surface.offset;
    float lift = lifted ? surface.lift : 0.0;
    vec3 horizon = lifted ? smooth_normal : surface.geometric_normal;
    vec3 origin = surface.position + lift * horizon;
    Bsdf b = make_bsdf(material, horizon, -direction);
#if HALFLIGHT_VOLUME
    vec3 light = vec3(1.0);
#if HALFLIGHT_DISPERSION
    if (b.disperses) light = dispersed_light(medium, material.channel);
#endif
    bool one_channel = is_one_channel(medium);
    if (b.thickness < 0.0) medium = vec4(b.absorption, -b.thickness);  // a ray from inside, whatever its origin knew
    scale_lobes(b, light * transmittance(medium, way));
#endif
#if HALFLIGHT_BY_CHANCE
    if (met_pane) emission *= make_met_pane(b);
#endif
    if (catches) make_catcher(b);
    if (listed) store_surface(path, SurfacePoint(origin, surface.offset, lift, emission, shown, catches), b);
#if HALFLIGHT_REUSE_POINTS
    if (lifted && dot(surface.smooth_normal, direction) >= 0.0) material.bent = true;  // the horizon depends on wo
    ReusePoint point = reuse_point(surface, material, b, ray, hit.t);
#if HALFLIGHT_BY_CHANCE
    if (met_pane) point.share = 0.0;  // other receivers would have met it by another chance
#endif
#if HALFLIGHT_VOLUME
    if (medium.w > 0.0 || one_channel) point.share = 0.0;  // neither is light inside of solids shared, nor one channel
#endif
    if (listed && is_hit) points[path] = point;
#endif
#endif
#if HALFLIGHT_STORE_RAYS
    ray.t_max = inside ? ray.t_max : -1.0;
    rays[path] = ray;
#endif
#if HALFLIGHT_STORE_HITS
    hit.triangle = is_hit ? hit.triangle : kMiss;
    hits[path] = hit;
#endif
}
