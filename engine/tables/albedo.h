// Directional albedo of the single-scattering GGX lobe, of solid transmission and of the sheen (shaders/SHADING.md).
#pragma once

#include "engine/core/image.h"
#include "engine/core/math.h"

namespace halflight {

/// Parts of the table besides that of the isotropic lobe.
struct AlbedoParts {
    bool sheen = false;
    bool anisotropy = false;
    bool solid = false;
};

/// E(f0, f90) = f0 * a + f90 * b.
struct DirectionalAlbedo {
    double a = 0;
    double b = 0;
};

/// Returns the albedo by deterministic quadrature in double, with `nodes` points per Gauss-Legendre rule. `cosine` is
/// in [0, 1], `alpha` in [1e-4, 1]. The error with 24 nodes is below 3e-5 for cosine > alpha / 100, else below 1e-4.
DirectionalAlbedo ggx_albedo(double cosine, double alpha, int nodes = 24);

/// Returns the albedo of an anisotropic lobe. `wo` has unit length and z >= 0. alpha.x along the x axis is not below
/// alpha.y, and both are in [1e-4, 1]. The error with 16 nodes is below 5e-4.
DirectionalAlbedo ggx_albedo(const dvec3& wo, const dvec2& alpha, int nodes = 16);

/// Returns the albedo of the sheen, which may exceed 1, by the same quadrature. `cosine` is in [0, 1], `roughness` in
/// [kLeastSheenRoughness, 1].
double sheen_albedo(double cosine, double roughness, int nodes = 24);

/// Albedo of a white solid's interface, without multiple scattering.
struct SolidAlbedo {
    double whole = 0;      // reflection and refraction by the Fresnel terms
    double refracted = 0;  // refraction of all light; of no meaning if facets reflect totally
};

/// Returns means over `samples` points. `eta`: index of refraction beyond the interface over that on the side of the
/// cosine.
SolidAlbedo solid_albedo(double cosine, double alpha, double eta, int samples);

/// Returns the table that shaders/lib/microfacet.glsl interpolates bilinearly. shaders/shared/albedo_coordinates.h
/// defines its axes. Channel 0 is E_1 = E_A + E_B. Channel 1 is E_B / E_1 - (1 - cosine)^5, the difference from a
/// mirror's. Interpolation errors relative to E_1:
///   E_1  below 1e-4, for cosines below 1e-4 below 2e-4
///   E_B  below 1e-4 where alpha >= 0.01, below 4e-4 elsewhere
/// The computation takes about 15 ms.
///
/// Other parts follow in rows of their own, in the order of AlbedoParts:
///   sheen       the albedo in channel 0; interpolation errors are below 1e-3
///   anisotropy  a table of four coordinates (shaders/shared/albedo_coordinates.h) with the channels of the first
///               part. It takes about 1 s of processor time. Errors relative to E_1 are below 0.3 % for 99 % of all
///               arguments, and below 2 % for all that the test draws
///   solid       a table of three coordinates. Channel 0 is SolidAlbedo::whole, channel 1 is `refracted`. Texels are
///               means of 256 points. It takes about 0.3 s. The mean error is 1e-3
Image build_albedo_table(AlbedoParts parts = {});

}  // namespace halflight
