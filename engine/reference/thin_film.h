// Reflectance of a thin film (SHADING.md, "Iridescence"). Belcour, Barla 2017, in the form of
// KHR_materials_iridescence.
#pragma once

#include "engine/core/math.h"

namespace halflight::reference {

struct ThinFilm {
    double ior = 1.3;
    double thickness = 400;  // nanometres
};

/// Returns the reflectance in linear Rec.709, in [0, 1], of a film on a substrate whose own reflectance at normal
/// incidence is `f0`. x = dot(wo, h) is in [0, 1].
dvec3 thin_film_reflectance(const ThinFilm& film, const dvec3& f0, double x);

}  // namespace halflight::reference
