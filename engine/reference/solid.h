// Reflection and refraction at the interface of solids (SHADING.md, "Solids").
#pragma once

#include "engine/core/math.h"

namespace halflight::reference {

/// Medium of the space that a ray crosses.
struct Medium {
    dvec3 absorption{0};   // per world unit
    double thickness = 0;  // length that stands for an endless way, > 0 inside of solids

    dvec3 transmittance(double distance) const { return exp(-absorption * distance); }
};

/// Returns the reflectance for unpolarised light. `x`: cosine with the facet's normal; `eta`: index of refraction
/// beyond over that of the cosine's side.
double dielectric_fresnel(double x, double eta);

/// Returns the direction of light that reaches wo through a facet of normal h. Precondition: its reflectance is
/// below 1.
dvec3 refract(const dvec3& wo, const dvec3& h, double eta);

/// Value of refraction in the frame of the normal, for wo.z > 0 and wi.z < 0.
struct Refraction {
    double value = 0;        // f |mu_i| of basic radiance, times 1 - reflectance
    double pdf = 0;          // density of refract() by visible normals, without the choice
    double reflectance = 1;  // reflectance of the facet
};
/// Returns zeros if no facet refracts so. `strength`: factor of the Fresnel reflectance.
Refraction evaluate_refraction(const dvec3& wo, const dvec3& wi, double alpha, double eta, double strength);

/// Interpolates a table of the albedo of reflection and refraction together, for a white interface.
double solid_albedo(double mu, double alpha, double eta, double strength);

}  // namespace halflight::reference
