// Directional albedo of the single-scattering GGX lobe, of solid transmission and of the sheen (shaders/SHADING.md).
#pragma once

#include "engine/core/image.h"

namespace halflight {

/// E(f0, f90) = f0 * a + f90 * b.
struct DirectionalAlbedo {
    double a = 0;
    double b = 0;
};

/// Returns the albedo by deterministic quadrature in double, with `nodes` points per Gauss-Legendre rule. `cosine` is
/// in [0, 1], `alpha` in [1e-4, 1]. The error with 24 nodes is below 3e-5 for cosine > alpha / 100, else below 1e-4.
DirectionalAlbedo ggx_albedo(double cosine, double alpha, int nodes = 24);

/// Returns the albedo of the sheen, which may exceed 1, by the same quadrature. `cosine` is in [0, 1], `roughness` in
/// [kLeastSheenRoughness, 1].
double sheen_albedo(double cosine, double roughness, int nodes = 24);

/// Returns the albedo of reflection and refraction of a white solid's interface, without multiple scattering, as the
/// mean over `samples` points. `eta`: index of refraction beyond the interface over that on the side of the cosine.
double solid_albedo(double cosine, double alpha, double eta, int samples);

/// Returns the table that shaders/lib/microfacet.glsl interpolates bilinearly. shaders/shared/albedo.h defines its
/// axes. Channel 0 is E_1 = E_A + E_B. Channel 1 is E_B / E_1 - (1 - cosine)^5, the difference from a mirror's.
/// Interpolation errors relative to E_1:
///   E_1  below 1e-4, for cosines below 1e-4 below 2e-4
///   E_B  below 1e-4 where alpha >= 0.01, below 4e-4 elsewhere
/// The computation takes about 15 ms.
///
/// If `sheen` is set, the sheen's table follows in rows of its own, with the albedo in channel 0. Interpolation errors
/// of the albedo are below 1e-3.
///
/// If `solid` is set, the table of solid transmission follows, with the albedo in channel 0 and a mean error of 1e-3.
/// It takes about 0.3 s.
Image build_albedo_table(bool sheen = false, bool solid = false);

}  // namespace halflight
