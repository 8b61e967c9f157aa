// The BSDF of a material (shaders/lib/material.glsl).
#include "shaders/lib/bsdf_record.glsl"
#include "shaders/lib/layers.glsl"
#include "shaders/lib/medium.glsl"

float average(vec3 c) { return (c.r + c.g + c.b) * (1.0 / 3.0); }

float ggx_alpha(float roughness) {
    float alpha = roughness * roughness;
    return alpha < kMirrorAlpha ? 0.0 : alpha;
}

vec3 dielectric_f0(Material m) { return min(m.dielectric_f0 * m.specular_color, vec3(1.0)) * m.specular; }

bool is_solid(Material m) {
    return kVolume && m.thickness > 0.0 && (m.transmission + m.diffuse_transmission) * (1.0 - m.metallic) > 0.0;
}

Layers layers_of(Material m, vec3 geometric_normal) {
    vec3 f0 = dielectric_f0(m);
    Layers l;
    l.normal = m.normal;
    l.horizon = is_solid(m) ? vec3(0.0) : geometric_normal;
    l.alpha = kGlossy ? ggx_alpha(m.roughness) : 0.0;
    l.f0 = max(f0.r, max(f0.g, f0.b));
    l.f90 = m.specular;
    l.coat = m.coat;
    l.coat_alpha = kClearcoat ? ggx_alpha(m.coat_roughness) : 0.0;
    l.coat_normal = m.coat_normal;
    l.sheen = max(m.sheen_color.r, max(m.sheen_color.g, m.sheen_color.b));
    l.sheen_roughness = max(m.sheen_roughness, kLeastSheenRoughness);
    l.rough_direction = vec3(0.0);
    l.alpha_across = l.alpha;
    l.film = m.iridescence;
    l.film_ior = m.film_ior;
    l.film_thickness = m.film_thickness + m.film_thickness_range;
    l.film_f0 = min(m.dielectric_f0 * m.specular_color, vec3(1.0));
    float alpha_along = mix(m.roughness * m.roughness, 1.0, m.anisotropy * m.anisotropy);
    if (kAnisotropy && m.anisotropy > 0.0 && alpha_along >= kMirrorAlpha) {
        l.rough_direction = m.rough_direction;
        l.alpha_across = max(l.alpha, kMirrorAlpha);
        l.alpha = alpha_along;
    }
    return l;
}

// Folds the factors that depend on wo alone into the BSDF at a surface.
Bsdf make_bsdf(Material m, vec3 geometric_normal, vec3 wo) {
    Layers layers = layers_of(m, geometric_normal);
    precise Bsdf b;  // precise: code of lobes that the material lacks must not change bits of others
    b.geometric_normal = geometric_normal;
    b.normal = m.normal;
    b.coat_normal = m.coat_normal;
    b.alpha = layers.alpha;
    b.specular = vec3(0.0);
    b.specular_edge = vec3(0.0);
    b.transmission = vec3(0.0);
    b.coat = 0.0;
    b.coat_alpha = layers.coat_alpha;
    b.p_diffuse = 1.0;
    b.p_transmission = 0.0;
    b.p_coat = 0.0;
    b.sheen = vec3(0.0);
    b.sheen_alpha = 1.0;
    b.p_sheen = 0.0;
    b.rough_direction = layers.rough_direction;
    b.alpha_across = layers.alpha_across;
    b.film_dielectric = vec3(0.0);
    b.film_metal = vec3(0.0);
    b.film_ior = layers.film_ior;
    b.film_thickness = layers.film_thickness;
    b.film_dielectric_f0 = layers.film_f0;
    b.film_metal_f0 = m.base_color;
    make_thin(b);
    b.diffuse = (1.0 - m.metallic) * m.base_color;
    b.diffuse_through = vec3(0.0);
    b.p_through = 0.0;
    if (kDiffuseTransmission)
        b.diffuse_through = (1.0 - m.metallic) * m.diffuse_transmission * m.diffuse_transmission_color;
    float glossy = 0.0;  // albedo of the glossy lobes
    if (kGlossy) {
        // Specular reflection of dielectric and metal.
        vec2 albedo = specular_albedo(layers, wo);
        float whole = albedo.x + albedo.y;  // E_1
        vec3 f0 = dielectric_f0(m);
        vec3 gain = (1.0 - m.metallic) * multiple_scattering_gain(f0, whole);
        bool solid = is_solid(m);
        float solid_share = solid ? m.transmission : 0.0;
        if (kVolume) gain *= 1.0 - solid_share;
        vec3 metal_gain = m.metallic * multiple_scattering_gain(m.base_color, whole);
        b.specular = metal_gain * m.base_color + gain * f0;
        b.specular_edge = metal_gain * (1.0 - m.base_color) + gain * (m.specular - f0);
        float below_layers = 1.0;
        vec3 film_of_dielectric = vec3(0.0), film_of_metal = vec3(0.0);
        if (kIridescence) {
            FilmWaves mean_waves = mean_film_waves(layers, albedo);
            film_of_dielectric = film_reflectance(mean_waves, b.film_dielectric_f0);
            film_of_metal = film_reflectance(mean_waves, b.film_metal_f0);
            float on_dielectric = (1.0 - m.metallic) * m.iridescence * m.specular;
            if (kVolume) on_dielectric *= 1.0 - solid_share;
            b.film_dielectric = on_dielectric * multiple_scattering_gain(film_of_dielectric, whole);
            b.film_metal = m.metallic * m.iridescence * multiple_scattering_gain(film_of_metal, whole);
            b.specular *= 1.0 - m.iridescence;
            b.specular_edge *= 1.0 - m.iridescence;
        }
        float below_specular = specular_share(layers, albedo);
        b.diffuse *= below_specular;
        b.diffuse_through *= below_specular;

        float sheen_whole = 0.0;
        if (kSheen) {
            sheen_whole = sheen_albedo(dot(m.normal, wo), layers.sheen_roughness);
            float below_sheen = sheen_share(layers, sheen_whole);
            scale_base(b, vec3(below_sheen));
            below_layers *= below_sheen;
            b.sheen = m.sheen_color / max(sheen_whole, 1.0);
            b.sheen_alpha = layers.sheen_roughness * layers.sheen_roughness;
        }
        float coat_albedo = 0.0;
        if (kClearcoat) {
            b.coat_normal = reflecting_normal(m.coat_normal, layers.horizon, wo);
            vec2 coat = coat_reflection(layers, wo);
            b.coat = coat.x;
            coat_albedo = coat.y;
            scale_base(b, vec3(1.0 - coat_albedo));
            below_layers *= 1.0 - coat_albedo;
            b.sheen *= 1.0 - coat_albedo;
        }
        float transmission = 0.0;
        if (kTransmission) {
            b.transmission = b.diffuse * (m.transmission / whole);
            b.diffuse *= 1.0 - m.transmission;
            b.diffuse_through *= 1.0 - m.transmission;
            transmission = average(b.transmission) * whole;
        }
        if (kVolume && solid) {
            float root = min(sqrt(m.dielectric_f0), 0.998);  // an index of refraction up to 999
            float ior = (1.0 + root) / (1.0 - root);
            float factor = solid_share * (1.0 - m.metallic) * below_layers;
            if (kDispersion) {
                b.disperses = m.dispersion > 0.0 && solid_share > 0.0 && ior > 1.0;
                ior = clamp(ior + (ior - 1.0) * 0.025 * m.dispersion * float(m.channel - 1), 1.0, 999.0);
            }
            b.eta = m.front ? ior : 1.0 / ior;
            b.transmission = factor * m.base_color;
            b.solid_reflection = vec3(factor);
            if (m.front) {
                vec3 strength = min(m.specular * m.specular_color, vec3(1.0));
                b.solid_specular = max(strength.r, max(strength.g, strength.b));
                b.solid_reflection = factor * (strength / max(b.solid_specular, 1e-20));
            }
            b.absorption = m.absorption;
            b.thickness = m.front ? m.thickness : -m.thickness;
            float mu = dot(m.normal, wo);
            b.solid_gain = is_solid_mirror(b) ? 1.0 : 1.0 / solid_albedo(mu, b.alpha_across, b.eta, b.solid_specular);
            transmission = average(max(b.transmission, b.solid_reflection));
        }
        // Probabilities of the glossy lobes.
        float specular = average(b.specular * whole + b.specular_edge * albedo.y);
        // The bound covers lobes that reflect more beside the mean cosine, where interference leaves little.
        if (kIridescence)
            specular += average(b.film_dielectric * max(film_of_dielectric, 0.05) +
                                b.film_metal * max(film_of_metal, 0.05)) * whole;
        glossy = specular + transmission + coat_albedo;
        if (kSheen) {
            float sheen = average(b.sheen) * max(sheen_whole, 1e-3);  // the bound covers errors of the table
            glossy += sheen;
            b.p_sheen = glossy > 0.0 ? sheen / glossy : 0.0;
        }
        b.p_transmission = glossy > 0.0 ? transmission / glossy : 0.0;
        b.p_coat = glossy > 0.0 ? coat_albedo / glossy : 0.0;
    }
    if (kDiffuseTransmission) b.diffuse *= 1.0 - m.diffuse_transmission;
    float diffuse = average(b.diffuse);
    if (kDiffuseTransmission) {
        float through = average(b.diffuse_through);
        diffuse += through;
        b.p_through = through > 0.0 ? min(through / diffuse, 1.0) : 0.0;  // a quotient may be rounded up
    }
    float sum = diffuse + glossy;
    b.p_diffuse = glossy > 0.0 ? min(diffuse / sum, 1.0) : 1.0;  // a black surface may pick either component
    if (!kDiffuse) b.p_diffuse = 0.0;
    return b;
}
