#include "engine/scene/black_body.h"

#include <algorithm>
#include <cmath>

namespace halflight {
namespace {

/// Returns a piecewise Gaussian: the inverse widths differ below and above the mean.
double lobe(double x, double mean, double below, double above) {
    const double t = (x - mean) * (x < mean ? below : above);
    return std::exp(-0.5 * t * t);
}

/// Returns the CIE 1931 colour matching functions at a wavelength in nanometres, by the multi-lobe fit of Wyman, Sloan
/// and Shirley 2013, "Simple Analytic Approximations to the CIE XYZ Color Matching Functions".
dvec3 matching(double w) {
    return {1.056 * lobe(w, 599.8, 1 / 37.9, 1 / 31.0) + 0.362 * lobe(w, 442.0, 1 / 16.0, 1 / 26.7) -
                0.065 * lobe(w, 501.1, 1 / 20.4, 1 / 26.2),
            0.821 * lobe(w, 568.8, 1 / 46.9, 1 / 40.5) + 0.286 * lobe(w, 530.9, 1 / 16.3, 1 / 31.1),
            1.217 * lobe(w, 437.0, 1 / 11.8, 1 / 36.0) + 0.681 * lobe(w, 459.0, 1 / 26.0, 1 / 13.8)};
}

}  // namespace

vec3 black_body_color(double kelvin) {
    constexpr double kSecond = 1.438777e7;  // second radiation constant, nanometres times kelvin
    dvec3 xyz(0);
    for (double w = 380; w <= 780; w += 5)  // nanometres
        xyz += matching(w) * std::pow(560 / w, 5) / std::expm1(kSecond / (w * kelvin));
    // XYZ to linear Rec.709 (IEC 61966-2-1).
    const dvec3 rgb = glm::max(
        dvec3(3.2406 * xyz.x - 1.5372 * xyz.y - 0.4986 * xyz.z, -0.9689 * xyz.x + 1.8758 * xyz.y + 0.0415 * xyz.z,
              0.0557 * xyz.x - 0.2040 * xyz.y + 1.0570 * xyz.z),
        dvec3(0));
    return vec3(rgb / std::max({rgb.r, rgb.g, rgb.b}));
}

double nearest_black_body(const vec3& color, double lowest, double highest) {
    constexpr double kExact = 1e-3;      // kelvin
    while (highest - lowest > kExact) {  // green and blue grow relative to red as the temperature rises
        const double middle = 0.5 * (lowest + highest);
        const vec3 body = black_body_color(middle);
        (body.r * (color.g + color.b) > color.r * (body.g + body.b) ? lowest : highest) = middle;
    }
    return 0.5 * (lowest + highest);
}

}  // namespace halflight
