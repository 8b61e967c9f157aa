// Follows the specular chains of paths by one vertex, and ends those that reach a surface that is no mirror.
//
// Variants: HALFLIGHT_CHAIN_BEGINS (first surfaces of all paths), HALFLIGHT_LAST_VERTEX (all chains end here),
// HALFLIGHT_CHAIN_PLACES (places are stored; rough lobes count as perfect mirrors)
#include "shaders/shared/frame_block.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/shared/chain_records.h"
#include "shaders/scene_tables.glsl"

layout(local_size_x = 64) in;

layout(std140) uniform FrameBlock { Frame frame; };
layout(std430) buffer Chains { SpecularChain chains[]; };
layout(std430) buffer PathRays { Ray path_rays[]; };
#if HALFLIGHT_CHAIN_PLACES
layout(std430) buffer Places { ChainPlace places[]; };
#endif
#if !HALFLIGHT_CHAIN_BEGINS
uniform usamplerBuffer arriving;         // R32UI: path indices
uniform usamplerBuffer arriving_header;  // RGBA32UI: ListHeader
#include "shaders/lib/hit_texels.glsl"
#endif
#if !HALFLIGHT_LAST_VERTEX
layout(std430) writeonly buffer Leaving { uint leaving[]; };
layout(std430) buffer LeavingHeader { ListHeader leaving_header; };
#if HALFLIGHT_TEXTURE_LEVELS
#include "shaders/lib/ray_cone.glsl"
layout(std430) buffer Cones { RayCone cones[]; };
#endif
#if HALFLIGHT_VOLUME
layout(std430) buffer Media { vec4 media[]; };
#endif
#endif

uniform uint depth;  // number of this vertex, 0: the first surface

#include "shaders/lib/camera.glsl"
#include "shaders/lib/dimensions.glsl"
#include "shaders/lib/finite.glsl"
#include "shaders/lib/offset.glsl"
#include "shaders/lib/path_list.glsl"
#include "shaders/lib/surface_record.glsl"
#include "shaders/lib/specular_branch.glsl"

#if !HALFLIGHT_LAST_VERTEX
DEFINE_APPEND(append_leaving, leaving_header)
#endif

// Returns the reflectance of the surface at which a chain ends. Light sources count as white up to a radiance of 1.
vec3 end_albedo(SurfacePoint at, Bsdf b, vec3 wo) {
    vec3 glow = all_finite(at.emission) ? clamp(at.emission, vec3(0.0), vec3(1.0)) : vec3(0.0);
    return at.is_surface ? max(clamp(reflectance(b, wo), vec3(0.0), vec3(1.0)), glow) : glow;
}

void main() {
    uint entry = gl_GlobalInvocationID.x;
#if HALFLIGHT_CHAIN_BEGINS
    bool active_path = true;
    uint path = entry;
    const float way = 0.0;
#else
    bool active_path = entry < texelFetch(arriving_header, 0).w;
    uint path = texelFetch(arriving, int(active_path ? entry : 0u)).x;
    Ray ray = path_rays[path];
    Hit hit = load_hit(path);
#endif
    SurfacePoint at = load_surface_point(path);
    Bsdf b = load_bsdf(path);
    vec3 position = seen_position(path, at);
#if HALFLIGHT_CHAIN_BEGINS
    vec3 wo = -camera_direction(frame, path, position);
    SpecularChain chain = SpecularChain(vec3(1.0), 0.0, vec3(0.0), 0.0, vec3(0.0), 0.0);
    vec3 others = vec3(0.0);  // the denoiser filters glossy light apart
#else
    vec3 wo = -normalize(ray.direction);
    float way = at.is_surface ? hit.t * length(ray.direction) : 0.0;
    SpecularChain chain = chains[path];
    chain.way += way;
    vec3 others = b.diffuse + b.diffuse_through;
#endif
#if HALFLIGHT_CHAIN_PLACES
    b.alpha = b.alpha <= kMostSharpRoughness * kMostSharpRoughness ? 0.0 : b.alpha;
    b.alpha_across = b.alpha_across <= kMostSharpRoughness * kMostSharpRoughness ? 0.0 : b.alpha_across;
    b.coat_alpha = b.coat_alpha <= kMostSharpRoughness * kMostSharpRoughness ? 0.0 : b.coat_alpha;
#if HALFLIGHT_CHAIN_BEGINS
    ChainPlace place = ChainPlace(position, kMiss, position, 0u, vec3(1.0, 0.0, 0.0), 0.0, vec3(0.0, 1.0, 0.0), 0.0,
                                  vec3(0.0, 0.0, 1.0), 0.0, vec3(0.0), 0.0);
#else
    ChainPlace place = places[path];
    place.seen += way * camera_direction(frame, path, place.seen);
#endif
#endif
    bool goes_on = false;
#if !HALFLIGHT_LAST_VERTEX
    vec2 xi = sample_2d(path_sampler(frame, path), vertex_dimension(depth, kDimensionDirection));
    SpecularBranch branch = specular_branch(b, wo, xi, others);
    vec3 throughput = chain.throughput * branch.weight;
    goes_on = active_path && at.is_surface && throughput != vec3(0.0) && all_finite(throughput);
    uint leaving_place = append_leaving(goes_on);
    if (goes_on) {
        chain.albedo += chain.throughput * branch.rest;
        chain.throughput = throughput;
        chain.bounces += 1.0;
        path_rays[path] = ray_from(at.position, at.offset, b.geometric_normal, branch.direction);
        leaving[leaving_place] = path;
#if HALFLIGHT_TEXTURE_LEVELS
#if HALFLIGHT_CHAIN_BEGINS
#if HALFLIGHT_OPTICS
        vec3 eye = camera_ray_of_path(frame, path).origin;
#else
        vec3 eye = frame.camera_position.xyz;
#endif
        cones[path] = scattered_cone(camera_cone(frame), distance(position, eye), 0.0);
#else
        cones[path] = scattered_cone(cones[path], way, 0.0);
#endif
#endif
#if HALFLIGHT_VOLUME
#if HALFLIGHT_CHAIN_BEGINS
        media[path] = medium_towards(b, vec4(0.0), branch.direction);
#else
        media[path] = medium_towards(b, media[path], branch.direction);
#endif
#endif
#if HALFLIGHT_CHAIN_PLACES
        // The mirror image moves by the reflected motion.
        mat3 turned = mat3(place.turned_x, place.turned_y, place.turned_z);
        turned -= 2.0 * outerProduct(turned * branch.facet, branch.facet);
        place.turned_x = turned[0];
        place.turned_y = turned[1];
        place.turned_z = turned[2];
        place.facet = place.bounces == 0.0 ? branch.facet : place.facet;
        place.bounces += 1.0;
#endif
    }
#endif
#if !HALFLIGHT_CHAIN_BEGINS
    if (!goes_on) {
        chain.albedo += chain.throughput * end_albedo(at, b, wo);
        chain.normal = at.is_surface ? b.normal : vec3(0.0);
        chain.escaped = at.is_surface ? 0.0 : 1.0;
#if HALFLIGHT_CHAIN_PLACES
        place.position = position;
        place.triangle = at.is_surface ? hit.triangle : kMiss;
        place.instance = hit.instance;
#endif
    }
#endif
    if (active_path) {
        chains[path] = chain;
#if HALFLIGHT_CHAIN_PLACES
        places[path] = place;
#endif
    }
}
