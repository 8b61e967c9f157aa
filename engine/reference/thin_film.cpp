#include "engine/reference/thin_film.h"

#include <cmath>

#include "engine/reference/ggx.h"

namespace halflight::reference {
namespace {

double squared(double v) {
    return v * v;
}

/// Returns the response of linear Rec.709 to a wave of the path difference `path` (metres), with a phase shift.
dvec3 sensitivity(double path, double shift) {
    struct Lobe {
        double value, position, variance;
    };
    const auto response = [&](const Lobe& l) {
        const double phase = 2 * kPi * path;
        return l.value * std::sqrt(2 * kPi * l.variance) * std::cos(l.position * phase + shift) *
               std::exp(-l.variance * phase * phase) / 1.0685e-7;
    };
    const double x = response({5.4856e-13, 1.6810e6, 4.3278e9}) + response({9.7470e-14, 2.2399e6, 4.5282e9});
    const double y = response({4.4201e-13, 1.7953e6, 9.3046e9}), z = response({5.2481e-13, 2.2084e6, 6.6121e9});
    return {3.2404542 * x - 1.5371385 * y - 0.4985314 * z, -0.9692660 * x + 1.8760108 * y + 0.0415560 * z,
            0.0556434 * x - 0.2040259 * y + 1.0572252 * z};
}

}  // namespace

dvec3 thin_film_reflectance(const ThinFilm& film, const dvec3& f0, double x) {
    const double ior = film.ior;
    const double presence = glm::smoothstep(0.0, 0.03, film.thickness) * glm::smoothstep(1.0, 1.05, ior);
    const double r12 = glm::mix(schlick(x), 1.0, squared((ior - 1) / (ior + 1)));
    const double cosine = std::sqrt(std::max(1 - (1 - x * x) / (ior * ior), 0.0));  // cosine of the angle in the film
    const double path = 2 * ior * std::min(film.thickness, 1e9) * 1e-9 * cosine;
    dvec3 result;
    for (int c = 0; c < 3; ++c) {
        const double root = std::sqrt(glm::clamp(f0[c], 0.0, 0.999999)), substrate = (1 + root) / (1 - root);
        const double r23 = glm::mix(schlick(cosine), 1.0, squared((substrate - ior) / (substrate + ior)));
        // The wave turns by pi where it is reflected at a denser medium, which the film is to the air outside.
        const double shift = kPi + (substrate < ior ? kPi : 0);
        const double both = std::min(r12 * r23, 0.9999), r = std::sqrt(both);
        const double all = squared(1 - r12) * r23 / (1 - both);
        double sum = r12 + all;
        for (int m = 1; m <= 2; ++m)
            sum += 2 * (all - (1 - r12)) * std::pow(r, m) * sensitivity(m * path, m * shift)[c];
        result[c] = glm::mix(f0[c] + (1 - f0[c]) * schlick(x), glm::clamp(sum, 0.0, 1.0), presence);
    }
    return result;
}

}  // namespace halflight::reference
