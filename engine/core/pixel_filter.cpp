#include "engine/core/pixel_filter.h"

#include <fmt/format.h>

#include <cmath>

namespace halflight {
namespace {

constexpr double kTerms[] = {0.35875, 0.48829, 0.14128, 0.01168};

/// Returns the integral of the Blackman-Harris window over [-1, t], divided by its integral over [-1, 1].
double blackman_harris_share(double t) {
    double sum = kTerms[0] * (t + 1);
    for (int k = 1; k < 4; ++k) sum += kTerms[k] / (k * kPi) * std::sin(k * kPi * t);
    return sum / (2 * kTerms[0]);
}

/// Returns the t at which blackman_harris_share() is `share`, by bisection to float precision.
double blackman_harris_point(double share) {
    double lower = -1, upper = 1;
    for (int i = 0; i < 40; ++i) {
        const double middle = 0.5 * (lower + upper);
        (blackman_harris_share(middle) <= share ? lower : upper) = middle;
    }
    return lower;
}

}  // namespace

const char* name(PixelFilter::Shape shape) {
    return shape == PixelFilter::Shape::box ? "box" : "blackman-harris";
}

double usual_radius(PixelFilter::Shape shape) {
    return shape == PixelFilter::Shape::box ? 0.5 : 1.5;
}

std::string text(const PixelFilter& filter) {
    return fmt::format("{}, radius {:g} pixels", name(filter.shape), filter.radius);
}

vec2 sample_point(const PixelFilter& filter, const vec2& xi) {
    const auto along = [&](float u) {
        const double t = filter.shape == PixelFilter::Shape::box ? 2.0 * u - 1 : blackman_harris_point(u);
        return static_cast<float>(0.5 + filter.radius * t);
    };
    return {along(xi.x), along(xi.y)};
}

}  // namespace halflight
