#include "engine/core/pixel_filter.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "engine/core/names.h"

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

struct ShapeInfo {
    const char* name;
    double usual_radius;            // pixels
    double (*point)(double share);  // inverse of the filter's distribution over [-1, 1]
};
/// Rows in the order of PixelFilter::Shape. The weights of Blackman-Harris fall to one half at 0.51 pixels.
constexpr std::array kShapes = {
    ShapeInfo{"box", 0.5, [](double share) { return 2.0 * share - 1; }},
    ShapeInfo{"blackman-harris", 1.5, blackman_harris_point},
};

const ShapeInfo& info(PixelFilter::Shape shape) {
    return kShapes.at(static_cast<std::size_t>(shape));
}

}  // namespace

std::span<const PixelFilter::Shape> filter_shapes() {
    static constexpr auto shapes = first_enumerators<PixelFilter::Shape, kShapes.size()>();
    return shapes;
}

const char* name(PixelFilter::Shape shape) {
    return info(shape).name;
}

double usual_radius(PixelFilter::Shape shape) {
    return info(shape).usual_radius;
}

std::string text(const PixelFilter& filter) {
    return fmt::format("{}, radius {:g} pixels", name(filter.shape), filter.radius);
}

vec2 sample_point(const PixelFilter& filter, const vec2& xi) {
    const auto along = [&](float u) { return static_cast<float>(0.5 + filter.radius * info(filter.shape).point(u)); };
    return {along(xi.x), along(xi.y)};
}

}  // namespace halflight
