// The layered material of SHADING.md ("BSDF") at one point, for one view direction: diffuse reflection, diffuse and
// rough transmission under a metal/dielectric GGX lobe under a sheen under a clearcoat.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>

#include "engine/core/math.h"
#include "engine/reference/albedo.h"
#include "engine/reference/ggx.h"
#include "engine/reference/solid.h"
#include "engine/reference/texture.h"
#include "engine/reference/thin_film.h"

namespace halflight::reference {

/// Material after texture lookups; ranges as in Material.
struct BsdfParameters {
    dvec3 base_color{1};
    double metallic = 1;
    double roughness = 1;
    double specular = 1;
    dvec3 specular_color{1};
    double ior = 1.5;
    double clearcoat = 0;
    double clearcoat_roughness = 0;
    double transmission = 0;
    double diffuse_transmission = 0;
    dvec3 diffuse_transmission_color{1};
    dvec3 sheen_color{0};
    double sheen_roughness = 0;
    double iridescence = 0;
    ThinFilm film{};
    double anisotropy = 0;
    dvec2 tangent_direction{1, 0};  // direction of higher roughness: components along tangent and bitangent
    dvec3 rough_direction{
        0};           // direction of higher roughness in world space, perpendicular to n; 0: there are no tangents
    Medium inside{};  // thickness 0: thin-walled
    bool straight_solid = false;  // true: light passes clear solid glass straight on
    bool front = true;            // true: wo is on the outside
    double dispersion = 0;

    bool is_solid() const { return inside.thickness > 0 && (transmission + diffuse_transmission) * (1 - metallic) > 0; }
};

/// Returns a texel, or white if there is no texture, so that factors stand alone.
using Lookup = std::function<dvec4(const TextureRef&, Encoding)>;
/// Returns the parameters of a material at a point. `base_color` includes texture and vertex colour.
BsdfParameters parameters_of(const Material& material, const dvec3& base_color, const Lookup& lookup);

/// Component by which light left a surface (SHADING.md, "Estimator").
enum class Component : std::uint8_t { diffuse, glossy };

/// The material at one point, to be evaluated and sampled. All directions have unit length, are in world space, and
/// point away from the surface.
class Bsdf {
  public:
    /// Prepares all lobes. n_g, n and n_k (the coat's normal) must be on wo's side and bent towards it. Lobes that
    /// mirror get normals whose mirror direction is above the horizon of n_g. `channel`: colour channel whose index of
    /// refraction solids have, 0 to 2.
    Bsdf(const BsdfParameters& parameters, const dvec3& wo, const dvec3& n_g, const dvec3& n, const dvec3& n_k,
         int channel = 1);

    bool disperses() const { return disperses_; }  ///< Returns whether colours have different directions.
    bool black() const { return black_; }          ///< Returns whether the material reflects nothing.

    /// Returns the share of light that passes the surface straight on (SHADING.md, Panes).
    dvec3 straight() const;
    /// Takes this light out of sample(). Precondition: straight() is not 0.
    void leave_out_straight();

    /// f times cosine by component, without mirrors, and the density of sample(), P_c p_c(wi), per solid angle.
    struct Value {
        dvec3 diffuse{0}, glossy{0};
        double pdf_diffuse = 0, pdf_glossy = 0;
    };
    Value evaluate(const dvec3& wi) const;

    struct Sample {
        dvec3 wi{0};
        dvec3 weight{0};  // f times cosine / pdf
        double pdf = 0;   // P_c p_c(wi); 0 for a mirror
        bool mirror = false;
        Component component = Component::diffuse;
    };
    /// Returns the medium of rays in this direction. `before` is that on wo's side.
    Medium medium_towards(const dvec3& wi, const Medium& before) const;

    /// Samples a direction; returns none if it contributes nothing. The three numbers are uniform in [0, 1).
    std::optional<Sample> sample(double u_lobe, double u1, double u2) const;

  private:
    enum Lobe { kDiffuse, kDiffuseThrough, kSpecular, kTransmission, kCoat, kSheen, kLobes };

    std::optional<Sample> sample_mirror(Lobe lobe) const;
    std::optional<Sample> sample_solid(double u_side, double u1, double u2) const;
    dvec3 specular_factor(double x) const;
    /// Returns alpha of a solid's interface, which is isotropic.
    double alpha_solid() const { return alpha_.y; }

    dvec3 wo_, n_g_;
    Frame base_frame_, coat_frame_, diffuse_frame_;
    dvec3 wo_base_, wo_coat_, wo_diffuse_;
    dvec2 alpha_;  // along the x and y axes of the base's frame
    double alpha_coat_;
    dvec3 specular_f0_,
        specular_f90_;  // F0 and F90 of metal and dielectric mixed, with compensation and the coat's loss
    ThinFilm film_;
    dvec3 film_metal_{0}, film_dielectric_{0};  // factors of the film's reflectance, compensation and losses included
    dvec3 metal_f0_, dielectric_f0_;            // reflectances of what is below the film
    dvec3 diffuse_, diffuse_through_, transmission_;  // albedos, [0, 1]
    double coat_scale_;                               // k M(0.04)
    double transmission_scale_;                       // 1 / E_1
    double sheen_roughness_;
    dvec3 sheen_{0};             // factor of sheen_value()
    double eta_ = 0;             // solids: index of refraction beyond over that on wo's side; 0: thin-walled
    dvec3 solid_reflection_{0};  // factor of reflected light at the solid's interface
    double solid_strength_ = 1;  // factor of its Fresnel reflectance
    double solid_scale_ = 1;     // 1 / albedo
    bool solid_mirror_ = false;
    bool straight_solid_;
    bool only_reflects_ = false;  // straight light was left out of the solid's interface
    Medium inside_;
    bool disperses_ = false;
    bool front_;
    std::array<double, kLobes> choice_{};  // probability of each lobe
    bool black_ = true;
};

}  // namespace halflight::reference
