// Directional albedo of the single-scattering GGX lobe (SHADING.md, "Directional albedo") and of the sheen.
#pragma once

#include "engine/core/math.h"

namespace halflight::reference {

/// Directional albedo of Fresnel terms: E(f0, f90) = f0 * a + f90 * b.
struct Albedo {
    double a = 0;
    double b = 0;
    double one() const { return a + b; }  ///< Returns E_1, the albedo without absorption.
};

/// Integrates by quadrature for alpha >= kMirrorAlpha, within 3e-6 of the same rule with 150 times the nodes; returns a
/// mirror below. `mu` is in [0, 1].
Albedo integrate_albedo(double mu, double alpha);

/// Interpolates a table of integrate_albedo(), 64 x 64 nodes over (cbrt(mu), cbrt(alpha)), cubically. The error of
/// either coefficient is 2e-6 on average, at most 1.2e-4 for mu > 0.02 and roughness > 0.03, and 4e-4 for roughness >
/// 0.05. It is up to 1e-2 for grazing near-mirrors, roughness < 0.02 and mu < 0.001.
Albedo directional_albedo(double mu, double alpha);

/// Integrates the anisotropic lobe. `wo` has unit length and z > 0; alpha.x >= alpha.y > 0.
Albedo integrate_albedo(const dvec3& wo, const dvec2& alpha);

/// Interpolates a table of integrate_albedo() cubically.
Albedo directional_albedo(const dvec3& wo, const dvec2& alpha);

/// Integrates the sheen's lobe, sheen_value() in sheen.h. `mu` is in [0, 1].
double integrate_sheen_albedo(double mu, double roughness);

/// Interpolates a table of integrate_sheen_albedo() cubically. The error is below 3e-4.
double sheen_albedo(double mu, double roughness);

}  // namespace halflight::reference
