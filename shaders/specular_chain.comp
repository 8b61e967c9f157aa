// Follows the specular chains of paths by one vertex, and ends those that reach a surface that is no mirror.
#include "shaders/shared/frame_block.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/shared/chain_records.h"
#include "shaders/scene_tables.glsl"

layout(local_size_x = 64) in;

const bool kBegins = HALFLIGHT_CHAIN_BEGINS != 0;     // first surfaces of all paths
const bool kLastVertex = HALFLIGHT_LAST_VERTEX != 0;  // all chains end here
const bool kPlaces = HALFLIGHT_CHAIN_PLACES != 0;     // places are stored; rough lobes count as perfect mirrors

#include "shaders/lib/ray_cone.glsl"
layout(std140) uniform FrameBlock { Frame frame; };
uniform usamplerBuffer arriving;         // R32UI: path indices
uniform usamplerBuffer arriving_header;  // RGBA32UI: ListHeader
uniform uint depth;                      // number of this vertex, 0: the first surface
layout(std430) buffer Chains { SpecularChain chains[]; };
layout(std430) buffer PathRays { Ray path_rays[]; };
OPTIONAL(HALFLIGHT_CHAIN_PLACES) layout(std430) buffer Places { ChainPlace places[]; };
OPTIONAL(!HALFLIGHT_LAST_VERTEX) layout(std430) writeonly buffer Leaving { uint leaving[]; };
OPTIONAL(!HALFLIGHT_LAST_VERTEX) layout(std430) buffer LeavingHeader { ListHeader leaving_header; };
OPTIONAL(!HALFLIGHT_LAST_VERTEX && HALFLIGHT_TEXTURE_LEVELS) layout(std430) buffer Cones { RayCone cones[]; };
OPTIONAL(!HALFLIGHT_LAST_VERTEX && HALFLIGHT_VOLUME) layout(std430) buffer Media { vec4 media[]; };

#include "shaders/lib/camera.glsl"
#include "shaders/lib/dimensions.glsl"
#include "shaders/lib/finite.glsl"
#include "shaders/lib/hit_texels.glsl"
#include "shaders/lib/offset.glsl"
#include "shaders/lib/path_list.glsl"
#include "shaders/lib/surface_record.glsl"
#include "shaders/lib/specular_branch.glsl"

#if HALFLIGHT_LAST_VERTEX
uint append_leaving(bool wanted) { return 0u; }
#else
DEFINE_APPEND(append_leaving, leaving_header)
#endif

// Returns the reflectance of the surface at which a chain ends. Light sources count as white up to a radiance of 1.
vec3 end_albedo(SurfacePoint at, Bsdf b, vec3 wo) {
    vec3 glow = all_finite(at.emission) ? clamp(at.emission, vec3(0.0), vec3(1.0)) : vec3(0.0);
    return at.is_surface ? max(clamp(reflectance(b, wo), vec3(0.0), vec3(1.0)), glow) : glow;
}

// Makes lobes that a chain may follow perfect mirrors.
float sharpened(float alpha) { return alpha <= kMostSharpRoughness * kMostSharpRoughness ? 0.0 : alpha; }

// Moves the mirror image by the reflected motion.
void reflect_place(inout ChainPlace place, vec3 facet) {
    mat3 turned = mat3(place.turned_x, place.turned_y, place.turned_z);
    turned -= 2.0 * outerProduct(turned * facet, facet);
    place.turned_x = turned[0];
    place.turned_y = turned[1];
    place.turned_z = turned[2];
    place.facet = place.bounces == 0.0 ? facet : place.facet;
    place.bounces += 1.0;
}

void main() {
    uint entry = gl_GlobalInvocationID.x;
    bool active_path = kBegins || entry < texelFetch(arriving_header, 0).w;
    uint path = kBegins ? entry : texelFetch(arriving, int(active_path ? entry : 0u)).x;
    SurfacePoint at = load_surface_point(path);
    Bsdf b = load_bsdf(path);
    vec3 position = seen_position(path, at);
    vec3 wo, others = vec3(0.0);  // others: at the first surface 0, because the denoiser filters glossy light apart
    float way = 0.0;
    Hit hit;
    SpecularChain chain = SpecularChain(vec3(1.0), 0.0, vec3(0.0), 0.0, vec3(0.0), 0.0);
    if (kBegins) {
        wo = -camera_direction(frame, path, position);
    } else {
        Ray ray = path_rays[path];
        hit = load_hit(path);
        wo = -normalize(ray.direction);
        way = at.is_surface ? hit.t * length(ray.direction) : 0.0;
        chain = chains[path];
        chain.way += way;
        others = b.diffuse + b.diffuse_through;
    }
    ChainPlace place = ChainPlace(position, kMiss, position, 0u, vec3(1.0, 0.0, 0.0), 0.0, vec3(0.0, 1.0, 0.0), 0.0,
                                  vec3(0.0, 0.0, 1.0), 0.0, vec3(0.0), 0.0);
    if (kPlaces) {
        b.alpha = sharpened(b.alpha);
        b.alpha_across = sharpened(b.alpha_across);
        b.coat_alpha = sharpened(b.coat_alpha);
        if (!kBegins) {
            place = places[path];
            place.seen += way * camera_direction(frame, path, place.seen);
        }
    }
    bool goes_on = false;
    if (!kLastVertex) {
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
            if (kTextureLevels && kBegins) {
                vec3 eye = HALFLIGHT_OPTICS != 0 ? camera_ray_of_path(frame, path).origin : frame.camera_position.xyz;
                cones[path] = scattered_cone(camera_cone(frame), distance(position, eye), 0.0);
            }
            if (kTextureLevels && !kBegins) cones[path] = scattered_cone(cones[path], way, 0.0);
            if (kVolume) media[path] = medium_towards(b, kBegins ? vec4(0.0) : media[path], branch.direction);
            if (kPlaces) reflect_place(place, branch.facet);
        }
    }
    if (!kBegins && !goes_on) {
        chain.albedo += chain.throughput * end_albedo(at, b, wo);
        chain.normal = at.is_surface ? b.normal : vec3(0.0);
        chain.escaped = at.is_surface ? 0.0 : 1.0;
        place.position = position;
        place.triangle = at.is_surface ? hit.triangle : kMiss;
        place.instance = hit.instance;
    }
    if (active_path) {
        chains[path] = chain;
        if (kPlaces) places[path] = place;
    }
}
