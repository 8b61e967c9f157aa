// One light sample at a vertex, weighted by component (SHADING.md, Estimator).
#include "shaders/lib/bsdf.glsl"
#include "shaders/lib/lights.glsl"
#include "shaders/lib/panes.glsl"

// Offset of the dimensions that only lights with a size use; no vertex reaches it.
const uint kDimensionsOfSizes = 0x8000u;

struct NextEvent {
    vec3 diffuse;  // radiance towards wo if the light is visible
    vec3 glossy;
    Ray ray;       // shadow ray that decides visibility
    uint group;    // light group; any without groups
};

bool contributes(vec3 radiance) { return any(notEqual(radiance, vec3(0.0))); }  // Returns true for NaN, too.

// Weights a light sample by multiple importance sampling, the power heuristic. Each of `count` such samples has this weight in the sum of all techniques' samples. `before`
// is the medium on wo's side.
NextEvent event_of(LightSample light, vec3 position, float offset, Bsdf b, vec3 wo, vec4 before, uint count) {
    BsdfValue f = evaluate_bsdf(b, wo, light.direction);
    bool delta = light.pdf == 0.0 || sampled_alone(light.link_set);
    float density = float(count) * light.pdf;
    precise NextEvent e;  // precise, so that all shaders compute equal bits (--keep-all)
    e.diffuse = f.diffuse * light.weight * (delta ? 1.0 : power_heuristic(density, b.p_diffuse * f.pdf_diffuse));
    e.glossy = f.glossy * light.weight * (delta ? 1.0 : power_heuristic(density, (1.0 - b.p_diffuse) * f.pdf_glossy));
    e.ray = shadow_ray(position, offset, b.geometric_normal, light);
    if (kVolume) {
        vec4 medium = medium_towards(b, before, light.direction);
        if (kSolidPanes && endless_way(medium) > 0.0) e.ray.t_min = kMarkedStart;  // begins inside
        vec3 passed = transmittance(medium, light.at_infinity ? endless_way(medium) : distance(light.end, position));
        e.diffuse *= passed;
        e.glossy *= passed;
    }
    e.ray.t_min = start_of_shadow_ray(e.ray.t_min, light.link_set);
    e.group = light.group;
    return e;
}

// Distance of the dimensions of one light's points from those of the next one; no vertex reaches it.
const uint kDimensionsPerLight = 0x10000u;

// Shares of choices that bound the noise where the strongest light is hidden: choices of any light, and choices without
// the environment, which walls hide from most of a room.
const float kAnyLight = 0.075, kWithoutSky = 0.2;

// Samples every light of the selection, and keeps one of the samples in proportion to the light that it would give if
// nothing were in between (Talbot, Cline, Egbert 2005, Importance Resampling for Global Illumination). There is one
// candidate per light, and the choice is mixed with a uniform one.
NextEvent sample_every_light(Receiver at, float offset, Bsdf b, vec3 wo, vec4 before, Sampler random, uint dimension,
                             uint count) {
    uint lights = light_count();
    float u = sample_1d(random, dimension + lights * kDimensionsPerLight);
    uint last = lights - 1u;  // the environment, if there is one
    uint any = u < kAnyLight ? min(uint(u / kAnyLight * float(lights)), last) : lights;
    u = (u - kAnyLight) / (1.0 - kAnyLight);
    float without = 0.0;
    bool only_lamps = false;
    if (kEnvironment) {
        uint kind = light_kind(word_of_float(texelFetch(scene_lights, int(last) * kLightStride).w));
        without = kind == kLightEnvironment ? kWithoutSky : 0.0;
        only_lamps = u < without;
        u = only_lamps ? u / without : (u - without) / (1.0 - without);
    }
    float sum = 0.0, own = 0.0, lamps = 0.0;  // lamps: sum without the last light
    uint chosen = 0u;
    NextEvent kept;
    for (uint light = 0u; light < lights; ++light) {
        vec2 xi = sample_2d(random, dimension + light * kDimensionsPerLight);
        NextEvent e = event_of(sample_of_light(at, light, xi, 1.0, 0.0), at.position, offset, b, wo, before, count);
        vec3 both = e.diffuse + e.glossy;
        float value = max(both.r, max(both.g, both.b));
        lamps = sum;
        sum += value;
        float share = sum > 0.0 ? value / sum : 1.0;
        bool left = light > 0u && u >= share;  // false for NaN, which is kept and counted
        u = left ? (u - share) / (1.0 - share) : u / share;
        left = left || (light == last && only_lamps && lamps > 0.0);
        if (any < lights ? light == any : !left) {
            kept = e;
            own = value;
            chosen = light;
        }
    }
    float probability = sum > 0.0 ? own / sum : 1.0;
    if (without > 0.0 && lamps > 0.0) probability = mix(probability, chosen == last ? 0.0 : own / lamps, without);
    float scale = 1.0 / mix(probability, 1.0 / float(lights), kAnyLight);
    kept.diffuse *= scale;
    kept.glossy *= scale;
    return kept;
}

// Samples one of the lights of the selection. offset: of the surface (SurfacePoint).
NextEvent sample_next_event(Receiver at, float offset, Bsdf b, vec3 wo, vec4 before, Sampler random, uint dimension,
                            uint count) {
    if (HALFLIGHT_EVERY_LIGHT != 0) return sample_every_light(at, offset, b, wo, before, random, dimension, count);
    LightSample light = sample_light(at, sample_2d_bits(random, dimension));
    return event_of(light, at.position, offset, b, wo, before, count);
}

// Samples the sun that is not part of the selection.
NextEvent sample_sun_event(Receiver at, float offset, Bsdf b, vec3 wo, vec4 before, Sampler random, uint dimension) {
    vec2 xi = kSizedSuns ? sample_2d(random, dimension + kDimensionsOfSizes) : vec2(0.0);
    return event_of(sample_sun(at, xi), at.position, offset, b, wo, before, 1u);
}

const Ray kDeadRay = Ray(vec3(0.0), 1.0, vec3(1.0), 0.0);

// Returns the MIS weight of light that a sampled ray hits. `pdf` is the ray's density within its component times the
// component's probability (0: delta). The weight is 1 if only one of both techniques can find the light.
float met_light_weight(float pdf, float light_density) {
    return pdf == 0.0 || light_density == 0.0 ? 1.0 : power_heuristic(pdf, light_density);
}
