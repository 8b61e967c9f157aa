// The GGX microfacet distribution in a frame whose z axis is the shading normal. Walter et al. 2007; Heitz 2014, 2018.
#pragma once

#include "engine/core/math.h"

namespace halflight::reference {

/// Below this alpha a lobe is a perfect mirror (SHADING.md).
inline constexpr double kMirrorAlpha = 1e-4;

/// Orthonormal, right-handed frame whose z axis is the normal.
struct Frame {
    dvec3 x, y, z;
    /// Builds the frame by the method of Duff et al., Building an Orthonormal Basis, Revisited (2017).
    explicit Frame(const dvec3& unit_normal);
    /// Builds the frame whose x axis is a unit vector perpendicular to the normal.
    Frame(const dvec3& unit_normal, const dvec3& unit_x) : x(unit_x), y(cross(unit_normal, unit_x)), z(unit_normal) {}
    dvec3 to_local(const dvec3& w) const { return {dot(w, x), dot(w, y), dot(w, z)}; }
    dvec3 to_world(const dvec3& w) const { return w.x * x + w.y * y + w.z * z; }
};

/// Returns the distribution D(h) per solid angle, for unit h with h.z > 0.
double ggx_distribution(const dvec3& h, double alpha);

/// Returns G2 / (4 mu_o mu_i) with the height-correlated Smith term (Heitz 2014, eq. 99); finite at grazing angles.
double ggx_visibility(double mu_o, double mu_i, double alpha);

/// Samples a normal distributed as D(h) max(dot(wo, h), 0) G1(wo) / wo.z (Heitz 2018). Precondition: wo.z > 0.
dvec3 sample_visible_normal(const dvec3& wo, double alpha, double u1, double u2);

/// Returns the solid angle density of reflect(wo, sample_visible_normal(wo)) at the direction whose half vector is h.
double reflection_pdf(const dvec3& wo, const dvec3& h, double alpha);

/// Returns the distribution with alpha along the x and the y axis, like the functions below.
double ggx_distribution(const dvec3& h, const dvec2& alpha);
double ggx_visibility(const dvec3& wo, const dvec3& wi, const dvec2& alpha);
dvec3 sample_visible_normal(const dvec3& wo, const dvec2& alpha, double u1, double u2);
double reflection_pdf(const dvec3& wo, const dvec3& h, const dvec2& alpha);

/// Returns (1 - x)^5, Schlick's weight of f90.
inline double schlick(double x) {
    const double m = glm::clamp(1 - x, 0.0, 1.0);
    return (m * m) * (m * m) * m;
}

}  // namespace halflight::reference
