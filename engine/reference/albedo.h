// Directional albedo of the single-scattering GGX lobe (SHADING.md, "Directional albedo").
#pragma once

namespace halflight::reference {

/// E(f0, f90) = f0 * a + f90 * b.
struct Albedo {
    double a = 0;
    double b = 0;
    double one() const { return a + b; }  ///< E_1, the albedo where nothing is absorbed.
};

/// By quadrature; error below 1e-5 for alpha >= kMirrorAlpha (test_reference_bsdf holds it against Monte Carlo).
/// mu in [0, 1]; a mirror below kMirrorAlpha.
Albedo integrate_albedo(double mu, double alpha);

/// From a table of integrate_albedo, 64 x 64 nodes over (sqrt(mu), sqrt(alpha)), cubic in between.
Albedo directional_albedo(double mu, double alpha);

}  // namespace halflight::reference
