// Pixel reconstruction filters.
#pragma once

#include <span>
#include <string>

#include "engine/core/math.h"

namespace halflight {

/// A separable filter, equal in x and y, non-negative, and zero beyond its radius. Sample points are drawn by inverting
/// its distribution (Shirley 1990; pbrt-v4, 8.8), so all samples of a pixel have equal weight. A new shape needs an
/// enumerator here and a row in pixel_filter.cpp.
struct PixelFilter {
    enum class Shape : std::uint8_t {
        box,
        blackman_harris,  // four terms (Harris 1978, table 1, -92 dB), scaled to the radius
    };
    Shape shape = Shape::box;
    double radius = 0.5;  // pixels from the pixel's centre in x and y, (0, kMaxFilterRadius]

    bool operator==(const PixelFilter&) const = default;
};
inline constexpr double kMaxFilterRadius = 16;  ///< pixels

/// Returns all shapes, in the order of help texts.
std::span<const PixelFilter::Shape> filter_shapes();
const char* name(PixelFilter::Shape shape);     ///< Returns the name on the command line.
double usual_radius(PixelFilter::Shape shape);  ///< Returns the default radius, pixels.
/// Returns a description: "blackman-harris, radius 1.5 pixels".
std::string text(const PixelFilter& filter);

/// Returns the sample point, pixels from the pixel's upper left corner, for a uniform point `xi` in [0, 1)^2. The box
/// of radius 0.5 returns `xi` itself, bit for bit.
vec2 sample_point(const PixelFilter& filter, const vec2& xi);

}  // namespace halflight
