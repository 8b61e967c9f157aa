// Next-event estimation: one of all lights, picked by an alias table or by the light tree. Needs
// shaders/geometry_tables.glsl and shaders/scene_tables.glsl.
#include "shaders/lib/alpha.glsl"
#include "shaders/lib/environment.glsl"
#include "shaders/lib/light_of_hit.glsl"
#include "shaders/lib/light_profile.glsl"
#include "shaders/lib/light_tree_traversal.glsl"
#include "shaders/lib/offset.glsl"
#include "shaders/lib/onb.glsl"
#include "shaders/lib/sampling.glsl"
#include "shaders/lib/sized_lights.glsl"
#include "shaders/lib/sun_light.glsl"
#include "shaders/shared/light.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/shared/word.h"

struct LightSample {
    vec3 direction;  // unit direction towards the light
    float pdf;       // density per solid angle, with the choice of the light; 0: a delta light, which no ray meets
    vec3 weight;     // radiance / pdf; delta lights: irradiance at normal incidence / probability. 0: no light arrives
    bool at_infinity;
    vec3 end;        // end of the shadow ray, on this side of the light's surface; unused at infinity
    uint group;      // light group; any if no light arrives, or without groups
    uint link_set;   // set of light links; 0 without links
};

const bool kLights = HALFLIGHT_LIGHTS != 0;  // the selection has lights
const bool kPunctualLights = HALFLIGHT_PUNCTUAL_LIGHTS != 0;
const bool kDirectionalLights = HALFLIGHT_DIRECTIONAL_LIGHTS != 0;
const bool kSpotLights = HALFLIGHT_SPOT_LIGHTS != 0;
const bool kSizedSuns = HALFLIGHT_SIZED_SUNS != 0;
const bool kEmissionTextures = HALFLIGHT_TEXTURE_EMISSION != 0;
const uint kSuns = kSun ? 1u : 0u;  // rows of the sun that is sampled apart
const bool kLightChoice = HALFLIGHT_LIGHT_CHOICE != 0;  // the selection has more than one light

Receiver receiver_at(vec3 position, vec3 normal, uint link_class) {
    return Receiver(position, float_of_word(link_class), normal, 0.0);
}
Receiver receiver_at(vec3 position, vec3 normal) { return receiver_at(position, normal, 0u); }

// Returns whether lights of a set light a receiver.
bool lights_receiver(uint link_set, Receiver at) {
    return !kLightLinks || lights_class(link_set, word_of_float(at.link_class));
}

// Returns the number of lights of the selection.
uint light_count() { return uint(light_texels() / kLightStride) - kSuns; }

// Samples the separate sun, which has the last row, by a point of the unit square if it has a size.
LightSample sample_sun(Receiver at, vec2 xi) {
    vec3 position = at.position;
    int row = light_texels() - kLightStride;
    LightSample s;
    s.direction = -texelFetch(scene_lights, row + 1).xyz;
    s.pdf = 0.0;
    s.weight = texelFetch(scene_lights, row + 3).rgb;
    if (kSizedSuns) {
        SizedLight sun = sized_light(position, texelFetch(scene_lights, row), -s.direction,
                                     texelFetch(scene_lights, row + 2).y);
        if (sun.spread > 0.0) {
            s.direction = sample_sized(sun, xi);
            s.pdf = density_of(sun);
            s.weight *= sun.radiance / s.pdf;
        }
    }
    s.at_infinity = true;
    s.end = position;
    s.group = kLightGroups > 0u ? sun_group() : 0u;
    s.link_set = link_set_entry(entry_of_light(uint(row / kLightStride)));
    if (!lights_receiver(s.link_set, at)) s.weight = vec3(0.0);
    return s;
}

// Samples a triangle. `last` is texel 3 of its row, with the density or probability of the whole choice in w.
void sample_triangle_light(vec3 position, int row, vec4 head, vec4 last, vec2 xi, inout LightSample s) {
    vec4 edge1_triangle = texelFetch(scene_lights, row + 1);
    vec4 edge2_bound = texelFetch(scene_lights, row + 2);
    vec2 at = sample_triangle(xi);
    vec3 inside = at.x * edge1_triangle.xyz + at.y * edge2_bound.xyz;
    vec3 point = head.xyz + inside;
    vec3 face = face_vector(edge1_triangle.xyz, edge2_bound.xyz);
    uint triangle = word_of_float(edge1_triangle.w);
    bool turned = edge2_bound.w < 0.0;
    bool emits = HALFLIGHT_BACKFACES != kEveryRay || (dot(face, point - position) < 0.0) != turned ||
                 (triangle_row(triangle).w & kTriangleOneSided) == 0u;
    if (HALFLIGHT_SLIVERS != 0) {
        // The row's edges are rounded, the table's corners are not, but they lie elsewhere in a moved instance.
        uvec3 corner = triangle_corners(triangle);
        vec3 a = corner_position(corner.x), b = corner_position(corner.y), c = corner_position(corner.z);
        vec3 off = max(abs(a - head.xyz), max(abs(b - head.xyz - edge1_triangle.xyz), abs(c - head.xyz - edge2_bound.xyz)));
        vec3 reach = max(abs(a), max(abs(b), abs(c)));
        bool here = max(off.x, max(off.y, off.z)) <= rounding_bound(16.0) * max(reach.x, max(reach.y, reach.z));
        face = here ? face_of_corners(a, b, c) : face;
        point = here ? (1.0 - at.x - at.y) * a + at.x * b + at.y * c : point;
    }
    vec3 normal = face * inversesqrt(max(dot(face, face), 1e-30));
    vec3 to_light = point - position;
    normal = dot(normal, to_light) > 0.0 ? -normal : normal;
    float square = dot(to_light, to_light);
    // The tracer's roundings grow with the distance from the ray's origin.
    float sliver = sliver_bound(-inside, edge1_triangle.xyz - inside, edge2_bound.xyz - inside);
    s.end = point + (abs(edge2_bound.w) + rounding_bound(8.0) * sqrt(square) + sliver) * normal;
    s.direction = to_light * inversesqrt(max(square, 1e-37));
    float cosine = -dot(normal, s.direction);
    s.pdf = last.w * square / cosine;
    vec3 emission = last.rgb;
    if (kEmissionTextures) {
        uvec4 t = triangle_row(triangle);
        uint slot = emission_texture_slot(t.w & 0x00ffffffu);
        vec4 uvs = interpolate_uvs(t.xyz, vec3(1.0 - at.x - at.y, at));
        emission *= color_texture(slot, uvs.xy, uvs.zw).rgb;
    }
    emission *= alpha_share(triangle, at.x, at.y);
    // Edge-on the light covers no solid angle. A point on the light itself receives nothing from it.
    bool visible = emits && cosine > 0.0 && square > 0.0 && s.pdf > 0.0 && !isinf(s.pdf);
    s.pdf = visible ? s.pdf : 0.0;
    s.weight = visible ? emission / s.pdf : vec3(0.0);
}

// Returns the share of a spot's intensity that leaves in a direction.
float spot_falloff(int row, vec3 leaving) {
    vec4 axis = texelFetch(scene_lights, row + 1);
    float cone = clamp((dot(leaving, axis.xyz) - axis.w) * texelFetch(scene_lights, row + 2).x, 0.0, 1.0);
    return cone * cone;
}

// Returns the share of the intensity of a punctual light that leaves in a direction.
float angular_falloff(int row, uint kind, vec3 leaving) {
    float share = 1.0;
    if (kSpotLights) share = kind == kLightSpot ? spot_falloff(row, leaving) : 1.0;
    if (kLightProfiles) share *= profile_share(row, leaving);
    return share;
}

void sample_punctual_light(vec3 position, int row, uint kind, vec4 head, vec4 last, vec2 xi, inout LightSample s) {
    vec3 travel = texelFetch(scene_lights, row + 1).xyz;
    vec3 to_light = head.xyz - position;
    float square = dot(to_light, to_light);
    bool directional = kDirectionalLights && kind == kLightDirectional;
    s.direction = directional ? -travel : to_light * inversesqrt(max(square, 1e-37));
    float falloff = directional ? 1.0 : (square > 0.0 ? 1.0 / square : 0.0);
    s.end = head.xyz;
    if (kSizedLights) {
        SizedLight light = sized_light(position, head, travel, texelFetch(scene_lights, row + 2).y);
        if (light.spread > 0.0) {
            s.direction = sample_sized(light, xi);
            float cosine = dot(s.direction, light.axis);
            vec3 across = s.direction - cosine * light.axis;
            s.end = position + distance_to_ball(light, cosine, dot(across, across)) * s.direction;
            falloff = light.radiance / density_of(light);
            s.pdf = last.w * density_of(light);
        }
    }
    if (kSpotLights || kLightProfiles) falloff *= angular_falloff(row, kind, -s.direction);
    s.weight = last.rgb * (isinf(falloff) ? 0.0 : falloff / last.w);
    s.at_infinity = directional;
}

// Returns the environment's share of the selections that the tree does not leave to the alias table. It is the share of
// the light that would arrive if nothing were in between. Neither side gets less than an eighth, because it may be the
// only one that is not occluded.
float environment_share(Receiver at) {
    if (!kEnvironment) return 0.0;
    precise float sky = environment_illuminance(at.normal);
    precise float lamps = light_tree_illuminance(at);
    precise float share = clamp(sky / (sky + lamps), 0.125, 0.875);
    return sky > 0.0 ? (lamps > 0.0 ? share : 1.0) : 0.0;
}

// Returns the factor by which the tree raises a light's probability of the alias table. `sky`: environment_share().
float light_tree_gain(LightWay way, float sky) {
    precise float gain = light_tree_header().gain * (1.0 - sky);
    return 1.0 + gain * way.probability;
}

// Returns the density per solid angle with which sample_light() at a receiver selects direction d (unit) of the
// environment.
float environment_pdf(Receiver from, vec3 d) {
    if (!kEnvironment) return 0.0;
    float probability = texelFetch(environment_warp, 0).z;
    if (kLightTree) probability += light_tree_header().share * environment_share(from);
    return probability * environment_density(from.normal, d);
}

// Returns a sample that carries no light.
LightSample no_light_sample(vec3 position) {
    LightSample s;
    s.direction = vec3(0.0, 0.0, 1.0);
    s.pdf = 0.0;
    s.weight = vec3(0.0);
    s.at_infinity = false;
    s.end = position;
    s.group = 0u;
    s.link_set = 0u;
    return s;
}

// Samples a point on a light by a point of the unit square. The row has the light's probability or density; `gain`
// multiplies it, and 0 stands for no light. `more` is added to the probability of the environment.
LightSample sample_of_light(Receiver at, uint light, vec2 xi, float gain, float more) {
    LightSample s = no_light_sample(at.position);
    int row = int(light) * kLightStride;
    vec4 head = texelFetch(scene_lights, row);
    vec4 last = texelFetch(scene_lights, row + 3);
    uint kind = light_kind(word_of_float(head.w));
    if (kLightGroups > 0u) s.group = group_of_light(light);
    if (kLightTree) {
        last.w *= gain;
        if (gain == 0.0) kind = kLightNone;
    }
    s.link_set = link_set_entry(entry_of_light(light));
    if (!lights_receiver(s.link_set, at)) kind = kLightNone;
    if (kAreaLights && kind == kLightTriangle) sample_triangle_light(at.position, row, head, last, xi, s);
    if (kPunctualLights && kind >= kLightPoint && kind <= kLightDirectional)
        sample_punctual_light(at.position, row, kind, head, last, xi, s);
    if (kEnvironment && kind == kLightEnvironment) {
        EnvironmentSample e = sample_environment(at.normal, xi);
        float probability = texelFetch(environment_warp, 0).z;
        if (kLightTree) probability += more;
        s.direction = e.direction;
        s.pdf = probability * e.density;
        s.weight = s.pdf > 0.0 ? e.radiance / s.pdf : vec3(0.0);
        s.at_infinity = true;
    }
    return s;
}

// Samples a light by a point of the unit square. Its first coordinate selects the light; the rest of it, and the second
// one, select the point on the light. Points that are stratified in the square are stratified on each light.
LightSample sample_light(Receiver at, SampleBits bits) {
    if (!kLights) return no_light_sample(at.position);
    uint choice = bits.x;
    float gain = 1.0, more = 0.0;
    float share = 0.0, sky = 0.0;
    precise float tree_share = 0.0;
    bool by_tree = false, is_sky = false;
    if (kLightTree) {
        share = light_tree_header().share;
        sky = environment_share(at);
        tree_share = share * (1.0 - sky);
        float top = unit_float(choice);
        by_tree = top < tree_share;
        is_sky = !by_tree && top < share;
        choice = left_of_choice(choice, 1u, top, by_tree ? 0.0 : is_sky ? tree_share : share,
                                by_tree ? tree_share : is_sky ? share - tree_share : 1.0 - share);
    }
    uint light = 0u;
    uint rest = choice;
    if (kLightChoice) {
        uint count = light_count();
        uint fraction;
        umulExtended(choice, count, light, fraction);
        light = by_tree ? 0u : light;  // the result is unused; row 0 avoids cache misses
        vec2 alias = texelFetch(light_alias, int(light)).xy;
        float u = unit_float(fraction);
        bool keep = u < alias.x;
        light = keep ? light : word_of_float(alias.y);
        rest = left_of_choice(choice, count, u, keep ? 0.0 : alias.x, keep ? alias.x : 1.0 - alias.x);
    }
    if (kLightTree) {
        // The density of a light that the table picks includes that of the tree.
        uint head_word = is_sky ? kLightEnvironment
                                : word_of_float(texelFetch(scene_lights, int(light) * kLightStride).w);
        LightWay way = LightWay(0u, 0.0, 0u);  // value for lights at infinity
        if (by_tree || light_kind(head_word) <= kLightSpot) way = light_way(at, !by_tree, light_trail(head_word), choice);
        bool leads_nowhere = by_tree && way.probability == 0.0;
        light = is_sky ? light_count() - 1u : by_tree && !leads_nowhere ? way.light : light;
        rest = is_sky ? choice : by_tree ? way.rest : rest;
        gain = leads_nowhere ? 0.0 : light_tree_gain(way, sky);
        more = share - tree_share;
    }
    return sample_of_light(at, light, vec2(unit_float(rest), unit_float(bits.y)), gain, more);
}

// Returns the density per solid angle with which sample_light() at a receiver picks the hit of a ray of unit direction.
// The hit is at `distance` on a surface of geometric normal n_g. The density is 0 if this is no light.
float light_pdf(Receiver from, Hit hit, vec3 direction, float distance, vec3 geometric_normal) {
    uint light = light_of_hit(hit);
    if (light == kNoLight) return 0.0;
    int row = int(light) * kLightStride;
    float density = texelFetch(scene_lights, row + 3).w;
    if (kLightTree) {
        uint trail = light_trail(word_of_float(texelFetch(scene_lights, row).w));
        density *= light_tree_gain(light_way(from, true, trail, 0u), environment_share(from));
    }
    float cosine = abs(dot(direction, geometric_normal));
    return cosine > 0.0 ? density * distance * distance / cosine : 0.0;
}

// Returns the ray from a surface (position, Surface::offset, n_g) to the light; t = 1 is the light. The tracer's t has
// roundings near 1, but the end already lies on this side of the light by its error bound.
Ray shadow_ray(vec3 position, float offset, vec3 geometric_normal, LightSample s) {
    Ray ray;
    ray.origin = offset_ray_origin(position, offset, geometric_normal, s.direction);
    ray.t_min = 0.0;
    ray.direction = s.at_infinity ? s.direction : s.end - ray.origin;
    ray.t_max = s.at_infinity ? uintBitsToFloat(0x7f800000u) : 1.0 - rounding_bound(8.0);
    return ray;
}
