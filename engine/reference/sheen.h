// The sheen's lobe (SHADING.md, "Sheen") in a frame whose z axis is the shading normal. Estevez, Kulla 2017.
#pragma once

#include "engine/core/math.h"

namespace halflight::reference {

/// Smaller perceptual roughnesses count as this one.
inline constexpr double kLeastSheenRoughness = 0.07;

/// Returns the lobe l_h times mu_i. Both directions are above the horizon.
double sheen_value(const dvec3& wo, const dvec3& wi, double roughness);

/// Returns the density of sample_sheen() per solid angle, for mu in [0, 1].
double sheen_pdf(double mu, double roughness);

/// Samples a direction above the horizon.
dvec3 sample_sheen(double roughness, double u1, double u2);

}  // namespace halflight::reference
