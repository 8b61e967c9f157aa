#include "engine/reference/bsdf.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/reference/sheen.h"

namespace halflight::reference {
namespace {

constexpr double kCoatF0 = 0.04;
constexpr double kMostIor = 999;  // greatest index of refraction of solids (SHADING.md, "Solids")

double mean(const dvec3& v) {
    return (v.x + v.y + v.z) / 3;
}

double max_component(const dvec3& v) {
    return std::max({v.x, v.y, v.z});
}

dvec3 mirror_at(const dvec3& w, const dvec3& n) {
    return 2 * dot(w, n) * n - w;
}

dvec3 normalize_or(const dvec3& v, const dvec3& otherwise) {
    const double square = dot(v, v);
    return square > 0 ? v / std::sqrt(square) : otherwise;
}

/// Bends a normal until the mirror direction of wo reaches the horizon (Keller et al. 2017).
dvec3 bend_above(const dvec3& horizon, const dvec3& n, const dvec3& wo) {
    const double least = std::min(0.9 * dot(horizon, wo), 0.01);
    const dvec3 mirrored = 2 * dot(n, wo) * n - wo;
    if (dot(mirrored, horizon) >= least) return n;
    const dvec3 along = normalize_or(mirrored - dot(mirrored, horizon) * horizon, dvec3(0));
    return normalize_or(wo + std::sqrt(1 - least * least) * along + least * horizon, horizon);
}

/// D V cosine and the density of one GGX reflection lobe in its own frame, both directions above the horizon.
struct LobeValue {
    double value = 0;  // D G2 / (4 mu_o mu_i) * mu_i
    double pdf = 0;
    double x = 0;  // cosine dot(wo, h)
};

LobeValue evaluate_lobe(const dvec3& wo, const dvec3& wi, const dvec2& alpha) {
    const dvec3 h = normalize(wo + wi);
    return {ggx_distribution(h, alpha) * ggx_visibility(wo, wi, alpha) * wi.z, reflection_pdf(wo, h, alpha),
            dot(wo, h)};
}

bool is_anisotropic(const BsdfParameters& p) {
    return p.anisotropy > 0 && p.rough_direction != dvec3(0);
}

/// Returns alpha along and across the direction of higher roughness. Lobes that are rough in one direction are no
/// mirrors in the other one.
dvec2 base_alpha(const BsdfParameters& p) {
    const double alpha = p.roughness * p.roughness;
    if (!is_anisotropic(p)) return dvec2(alpha);
    const double along = glm::mix(alpha, 1.0, p.anisotropy * p.anisotropy);
    return {along, along < kMirrorAlpha ? along : std::max(alpha, kMirrorAlpha)};
}

/// Returns the frame of the base's specular lobe.
Frame base_frame(const BsdfParameters& p, const dvec3& wo, const dvec3& n_g, const dvec3& n) {
    const dvec3 bent = p.is_solid() ? n : bend_above(n_g, n, wo);
    if (!is_anisotropic(p)) return Frame(bent);
    if (bent == n) return {n, p.rough_direction};
    const dvec3 along = p.rough_direction - dot(p.rough_direction, bent) * bent;
    return {bent, normalize_or(along, Frame(bent).x)};
}

}  // namespace

BsdfParameters parameters_of(const Material& m, const dvec3& base_color, const Lookup& lookup) {
    using enum Encoding;
    const dvec4 metallic_roughness = lookup(m.metallic_roughness_texture, linear);
    BsdfParameters p;
    p.base_color = base_color;
    p.metallic = m.metallic * metallic_roughness.b;
    p.roughness = m.roughness * metallic_roughness.g;
    p.specular = m.specular * lookup(m.specular_texture, linear).a;
    p.specular_color = dvec3(m.specular_color) * dvec3(lookup(m.specular_color_texture, srgb));
    p.ior = m.ior;
    p.clearcoat = m.clearcoat * lookup(m.clearcoat_texture, linear).r;
    p.clearcoat_roughness = m.clearcoat_roughness * lookup(m.clearcoat_roughness_texture, linear).g;
    p.transmission = m.transmission * lookup(m.transmission_texture, linear).r;
    p.diffuse_transmission = m.diffuse_transmission * lookup(m.diffuse_transmission_texture, linear).a;
    p.diffuse_transmission_color =
        dvec3(m.diffuse_transmission_color) * dvec3(lookup(m.diffuse_transmission_color_texture, srgb));
    p.inside.thickness = m.thickness;
    p.straight_solid = m.straight_shadows && m.dispersion == 0;
    p.dispersion = m.ior < kInfiniteIor ? m.dispersion : 0;
    if (m.attenuation_distance > 0)
        p.inside.absorption = -log(max(dvec3(m.attenuation_color), 1e-30)) / double(m.attenuation_distance);
    p.sheen_color = dvec3(m.sheen_color) * dvec3(lookup(m.sheen_color_texture, srgb));
    p.sheen_roughness = m.sheen_roughness * lookup(m.sheen_roughness_texture, linear).a;
    p.iridescence = m.iridescence * lookup(m.iridescence_texture, linear).r;
    p.film.ior = m.iridescence_ior;
    p.film.thickness = glm::mix<double>(m.iridescence_thickness_minimum, m.iridescence_thickness_maximum,
                                        lookup(m.iridescence_thickness_texture, linear).g);
    const dvec4 anisotropy = lookup(m.anisotropy_texture, linear);
    p.anisotropy = m.anisotropy_strength * anisotropy.b;
    const dvec2 d = m.anisotropy_texture ? 2.0 * dvec2(anisotropy) - 1.0 : dvec2(1, 0);
    const double turn = m.anisotropy_rotation, cosine = std::cos(turn), sine = std::sin(turn);
    p.tangent_direction = {cosine * d.x - sine * d.y, sine * d.x + cosine * d.y};
    return p;
}

Bsdf::Bsdf(const BsdfParameters& p, const dvec3& wo, const dvec3& n_g, const dvec3& n, const dvec3& n_k, int channel)
    : wo_(wo),
      n_g_(n_g),
      base_frame_(base_frame(p, wo, n_g, n)),
      coat_frame_(p.is_solid() ? n_k : bend_above(n_g, n_k, wo)),
      diffuse_frame_(n),
      wo_base_(base_frame_.to_local(wo)),
      wo_coat_(coat_frame_.to_local(wo)),
      wo_diffuse_(diffuse_frame_.to_local(wo)),
      alpha_(base_alpha(p)),
      alpha_coat_(p.clearcoat_roughness * p.clearcoat_roughness),
      film_(p.film),
      metal_f0_(p.base_color),
      dielectric_f0_(min(std::pow((p.ior - 1) / (p.ior + 1), 2) * p.specular_color, dvec3(1))),
      sheen_roughness_(p.sheen_roughness),
      straight_solid_(p.straight_solid),
      inside_(p.inside),
      front_(p.front) {
    const dvec3 c = p.base_color;
    const double m = p.metallic, k = p.clearcoat;

    double under_coat = 1;
    coat_scale_ = 0;
    double coat_albedo = 0;
    if (k > 0) {
        const Albedo e = directional_albedo(wo_coat_.z, alpha_coat_);
        coat_scale_ = k * (1 + kCoatF0 * (1 - e.one()) / e.one());
        coat_albedo = coat_scale_ * (kCoatF0 * e.a + e.b);
        under_coat = 1 - coat_albedo;
    }

    double sheen_mean = 0, under_sheen = under_coat;
    if (p.sheen_color != dvec3(0)) {
        const double raw = sheen_albedo(wo_diffuse_.z, p.sheen_roughness), albedo = std::min(raw, 1.0);
        sheen_ = under_coat * p.sheen_color / std::max(raw, 1.0);
        sheen_mean = under_coat * mean(p.sheen_color) * std::max(albedo, 1e-3);
        under_sheen *= 1 - max_component(p.sheen_color) * albedo;
    }

    const Albedo e =
        alpha_.x == alpha_.y ? directional_albedo(wo_base_.z, alpha_.x) : directional_albedo(wo_base_, alpha_);
    const double lost = (1 - e.one()) / e.one();
    const double r0 = (p.ior - 1) / (p.ior + 1);
    const dvec3 f0_dielectric = min(r0 * r0 * p.specular_color, dvec3(1)) * p.specular;
    const dvec3 scale_metal = m * (1.0 + c * lost);
    const bool solid = p.is_solid();
    const double opaque = (1 - m) * (solid ? 1 - p.transmission : 1.0);
    const dvec3 scale_dielectric = 1.0 + f0_dielectric * lost;
    specular_f0_ = under_sheen * (scale_metal * c + opaque * scale_dielectric * f0_dielectric);
    specular_f90_ = under_sheen * (scale_metal + opaque * scale_dielectric * p.specular);

    dvec3 dielectric_albedo = scale_dielectric * (f0_dielectric * e.a + p.specular * e.b);
    double film_mean = 0;
    if (p.iridescence > 0) {
        // The film's mean is taken at the cosine whose Schlick weight is the mean one of the lobe.
        const double x = 1 - std::pow(e.b / e.one(), 0.2);
        const dvec3 on_metal = thin_film_reflectance(p.film, metal_f0_, x);
        const dvec3 on_dielectric = thin_film_reflectance(p.film, dielectric_f0_, x);
        const auto gained = [&](const dvec3& f) { return 1.0 + f * lost; };
        film_metal_ = under_sheen * m * p.iridescence * gained(on_metal);
        film_dielectric_ = under_sheen * opaque * p.iridescence * p.specular * gained(on_dielectric);
        // The bound of 0.05 keeps weights low where the film is dark at the mean cosine alone.
        film_mean = mean(film_metal_ * max(on_metal, 0.05) + film_dielectric_ * max(on_dielectric, 0.05)) * e.one();
        dielectric_albedo =
            mix(dielectric_albedo, p.specular * gained(on_dielectric) * on_dielectric * e.one(), p.iridescence);
        specular_f0_ *= 1 - p.iridescence;
        specular_f90_ *= 1 - p.iridescence;
    }
    const double below = under_sheen * (1 - m) * (1 - std::min(max_component(dielectric_albedo), 1.0));
    diffuse_ = below * (1 - p.transmission) * (1 - p.diffuse_transmission) * c;
    diffuse_through_ = below * (1 - p.transmission) * p.diffuse_transmission * p.diffuse_transmission_color;
    transmission_ = below * p.transmission * c;
    transmission_scale_ = 1 / e.one();
    double transmission_mean = mean(transmission_);
    if (solid) {
        disperses_ = p.dispersion > 0 && p.transmission > 0 && p.ior > 1;
        // The Abbe number V spreads the index by (ior - 1) / V from the C line, red, to the F line, blue.
        const double base_ior = std::min(p.ior, kMostIor);
        const double abbe = 20 / p.dispersion, spread = disperses_ ? (base_ior - 1) / abbe : 0;
        const double ior = std::clamp(base_ior + spread * (channel - 1) / 2, 1.0, kMostIor);
        eta_ = p.front ? ior : 1 / ior;
        const double share = under_sheen * (1 - m) * p.transmission;
        transmission_ = share * c;
        const dvec3 reflected = p.front ? min(p.specular * p.specular_color, dvec3(1)) : dvec3(1);
        solid_strength_ = max_component(reflected);  // light that no channel reflects passes
        solid_reflection_ = solid_strength_ > 0 ? share * reflected / solid_strength_ : dvec3(0);
        solid_mirror_ = alpha_solid() * std::abs(eta_ - 1) < kMirrorAlpha;
        solid_scale_ = solid_mirror_ ? 1 : 1 / solid_albedo(wo_base_.z, alpha_solid(), eta_, solid_strength_);
        transmission_mean = mean(max(transmission_, solid_reflection_));
    }

    choice_ = {mean(diffuse_),
               mean(diffuse_through_),
               mean(specular_f0_ * e.a + specular_f90_ * e.b) + film_mean,
               transmission_mean,
               coat_albedo,
               sheen_mean};
    const double total = std::accumulate(choice_.begin(), choice_.end(), 0.0);
    black_ = !(total > 0);
    if (!black_) {
        for (double& probability : choice_) probability /= total;
    }
}

dvec3 Bsdf::specular_factor(double x) const {
    const dvec3 plain = specular_f0_ + (specular_f90_ - specular_f0_) * schlick(x);
    if (film_metal_ == dvec3(0) && film_dielectric_ == dvec3(0)) return plain;
    return plain + film_metal_ * thin_film_reflectance(film_, metal_f0_, x) +
           film_dielectric_ * thin_film_reflectance(film_, dielectric_f0_, x);
}

Bsdf::Value Bsdf::evaluate(const dvec3& wi) const {
    Value result;
    const double side_g = dot(wi, n_g_);
    const dvec3 wi_base = base_frame_.to_local(wi);
    const dvec3 wi_diffuse = diffuse_frame_.to_local(wi);
    if (side_g < 0 && wi_diffuse.z < 0) {
        result.diffuse = diffuse_through_ * (-wi_diffuse.z / kPi);
        result.pdf_diffuse = choice_[kDiffuseThrough] * -wi_diffuse.z / kPi;
    }
    if (side_g > 0 && wi_diffuse.z > 0) {
        result.diffuse = diffuse_ * (wi_diffuse.z / kPi);
        result.pdf_diffuse = choice_[kDiffuse] * wi_diffuse.z / kPi;
        if (sheen_ != dvec3(0)) {
            result.glossy += sheen_ * sheen_value(wo_diffuse_, wi_diffuse, sheen_roughness_);
            result.pdf_glossy += choice_[kSheen] * sheen_pdf(wi_diffuse.z, sheen_roughness_);
        }
    }
    if (side_g > 0 && wi_base.z > 0) {
        if (alpha_.x >= kMirrorAlpha && choice_[kSpecular] > 0) {
            const LobeValue lobe = evaluate_lobe(wo_base_, wi_base, alpha_);
            result.glossy += specular_factor(lobe.x) * lobe.value;
            result.pdf_glossy += choice_[kSpecular] * lobe.pdf;
        }
        if (eta_ > 0 && !solid_mirror_) {
            const LobeValue lobe = evaluate_lobe(wo_base_, wi_base, dvec2(alpha_solid()));
            const double reflectance = solid_strength_ * dielectric_fresnel(lobe.x, eta_);
            result.glossy += solid_reflection_ * (solid_scale_ * reflectance * lobe.value);
            result.pdf_glossy += choice_[kTransmission] * reflectance * lobe.pdf;
        }
    } else if (side_g < 0 && wi_base.z < 0 && eta_ > 0) {
        if (!solid_mirror_) {
            const Refraction lobe = evaluate_refraction(wo_base_, wi_base, alpha_solid(), eta_, solid_strength_);
            result.glossy += transmission_ * (solid_scale_ * lobe.value);
            result.pdf_glossy += choice_[kTransmission] * (1 - lobe.reflectance) * lobe.pdf;
        }
    } else if (side_g < 0 && wi_base.z < 0 && alpha_.x >= kMirrorAlpha && choice_[kTransmission] > 0) {
        const LobeValue lobe = evaluate_lobe(wo_base_, {wi_base.x, wi_base.y, -wi_base.z}, alpha_);
        result.glossy += transmission_ * (lobe.value * transmission_scale_);
        result.pdf_glossy += choice_[kTransmission] * lobe.pdf;
    }
    if (side_g > 0 && alpha_coat_ >= kMirrorAlpha && choice_[kCoat] > 0) {
        const dvec3 wi_coat = coat_frame_.to_local(wi);
        if (wi_coat.z > 0) {
            const LobeValue lobe = evaluate_lobe(wo_coat_, wi_coat, dvec2(alpha_coat_));
            result.glossy += coat_scale_ * (kCoatF0 + (1 - kCoatF0) * schlick(lobe.x)) * lobe.value;
            result.pdf_glossy += choice_[kCoat] * lobe.pdf;
        }
    }
    return result;
}

std::optional<Bsdf::Sample> Bsdf::sample_mirror(Lobe lobe) const {
    Sample s;
    s.mirror = true;
    s.component = Component::glossy;
    if (lobe == kTransmission) {
        s.wi = -wo_;
        s.weight = transmission_ / choice_[lobe];
    } else {
        s.wi = mirror_at(wo_, lobe == kCoat ? coat_frame_.z : base_frame_.z);
        if (dot(s.wi, n_g_) <= 0) return std::nullopt;
        const dvec3 fresnel = lobe == kCoat ? dvec3(coat_scale_ * (kCoatF0 + (1 - kCoatF0) * schlick(wo_coat_.z)))
                                            : specular_factor(wo_base_.z);
        s.weight = fresnel / choice_[lobe];
    }
    return s;
}

Medium Bsdf::medium_towards(const dvec3& wi, const Medium& before) const {
    if (eta_ == 0 || only_reflects_) return before;
    const bool passes = dot(wi, n_g_) < 0;
    if (passes == front_) return inside_;
    return passes ? Medium() : before;
}

std::optional<Bsdf::Sample> Bsdf::sample_solid(double u_side, double u1, double u2) const {
    const dvec3 h =
        base_frame_.to_world(solid_mirror_ ? dvec3(0, 0, 1) : sample_visible_normal(wo_base_, alpha_solid(), u1, u2));
    Sample s;
    s.component = Component::glossy;
    bool passes = false;
    const auto scatter = [&](const dvec3& facet) {
        // The rest of a pane reflects as from outside.
        const double eta = only_reflects_ ? std::max(eta_, 1 / eta_) : eta_;
        passes = u_side >= solid_strength_ * dielectric_fresnel(std::clamp(dot(wo_, facet), 0.0, 1.0), eta);
        s.wi = normalize(passes ? refract(wo_, facet, eta_) : mirror_at(wo_, facet));
    };
    scatter(h);
    const auto right_side = [&](const dvec3& n) { return passes ? dot(s.wi, n) < 0 : dot(s.wi, n) > 0; };
    if (solid_mirror_) {
        if (!right_side(n_g_)) scatter(n_g_);  // the mirror then uses the geometric normal
        if (!right_side(n_g_)) return std::nullopt;
        s.mirror = true;
        s.weight = (passes ? transmission_ : solid_reflection_) / choice_[kTransmission];
        return s;
    }
    if (!right_side(n_g_) || !right_side(base_frame_.z)) return std::nullopt;
    const Value value = evaluate(s.wi);
    s.pdf = value.pdf_glossy;
    if (!(s.pdf > 0)) return std::nullopt;
    s.weight = value.glossy / s.pdf;
    return s;
}

dvec3 Bsdf::straight() const {
    if (alpha_.x >= kMirrorAlpha) return dvec3(0);
    if (eta_ == 0) return transmission_;
    if (!straight_solid_) return dvec3(0);
    const double x = std::min(std::abs(dot(wo_, base_frame_.z)), 1.0);
    return transmission_ * (1 - solid_strength_ * dielectric_fresnel(x, std::max(eta_, 1 / eta_)));
}

void Bsdf::leave_out_straight() {
    if (eta_ > 0) {
        transmission_ = dvec3(0);
        only_reflects_ = true;
        return;
    }
    const double others = 1 - choice_[kTransmission];
    transmission_ = dvec3(0);
    choice_[kTransmission] = 0;
    black_ = !(others > 0);
    if (black_) return;
    for (double& probability : choice_) probability /= others;
}

std::optional<Bsdf::Sample> Bsdf::sample(double u_lobe, double u1, double u2) const {
    if (black_) return std::nullopt;
    int chosen = 0;
    while (chosen < kLobes - 1 && u_lobe >= choice_[chosen]) u_lobe -= choice_[chosen++];
    const Lobe lobe = static_cast<Lobe>(chosen);
    if (!(choice_[lobe] > 0)) return std::nullopt;  // u_lobe ran past the last lobe by rounding

    if (lobe == kTransmission && eta_ > 0) return sample_solid(u_lobe / choice_[lobe], u1, u2);
    const dvec2 alpha = lobe == kCoat ? dvec2(alpha_coat_) : alpha_;
    const bool diffuse = lobe == kDiffuse || lobe == kDiffuseThrough;
    if (!diffuse && lobe != kSheen && alpha.x < kMirrorAlpha) return sample_mirror(lobe);

    const Frame& frame = lobe == kCoat ? coat_frame_ : diffuse || lobe == kSheen ? diffuse_frame_ : base_frame_;
    dvec3 wi;
    if (diffuse) {
        const double r = std::sqrt(u1), phi = 2 * kPi * u2, z = std::sqrt(1 - u1);
        wi = {r * std::cos(phi), r * std::sin(phi), lobe == kDiffuse ? z : -z};
    } else if (lobe == kSheen) {
        wi = sample_sheen(sheen_roughness_, u1, u2);
    } else {
        const dvec3& wo = lobe == kCoat ? wo_coat_ : wo_base_;
        wi = mirror_at(wo, sample_visible_normal(wo, alpha, u1, u2));
        if (wi.z <= 0) return std::nullopt;
        if (lobe == kTransmission) wi.z = -wi.z;
    }

    Sample s;
    s.wi = normalize(frame.to_world(wi));
    // Lobes of other normals may have light on the wrong side.
    const bool passes = lobe == kTransmission || lobe == kDiffuseThrough;
    if ((dot(s.wi, n_g_) < 0) != passes) return std::nullopt;
    s.component = diffuse ? Component::diffuse : Component::glossy;
    const Value value = evaluate(s.wi);
    s.pdf = diffuse ? value.pdf_diffuse : value.pdf_glossy;
    if (!(s.pdf > 0)) return std::nullopt;
    s.weight = (diffuse ? value.diffuse : value.glossy) / s.pdf;
    return s;
}

}  // namespace halflight::reference
