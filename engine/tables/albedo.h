// Directional albedo of the single-scattering GGX lobe (shaders/SHADING.md, "Directional albedo").
#pragma once

#include "engine/core/image.h"

namespace halflight {

/// E(f0, f90) = f0 * a + f90 * b.
struct DirectionalAlbedo {
    double a = 0;
    double b = 0;
};

/// By deterministic quadrature in double. cosine in [0, 1], alpha in [1e-4, 1]; nodes: of each Gauss-Legendre rule.
/// Error with 24 nodes: below 3e-5 for cosine > alpha / 100, below 1e-4 otherwise.
DirectionalAlbedo ggx_albedo(double cosine, double alpha, int nodes = 24);

/// What shaders/lib/microfacet.glsl interpolates bilinearly, axes as in shaders/shared/albedo.h, 2 channels: E_1 = E_A
/// + E_B, and E_B / E_1 - (1 - cosine)^5, the difference from a mirror's. Errors by interpolation, relative to E_1: of
/// E_1 below 1e-4 (2e-4 for cosines below 1e-4), of E_B below 1e-4 where alpha >= 0.01 and below 4e-4 elsewhere. About
/// 15 ms.
Image build_albedo_table();

}  // namespace halflight
