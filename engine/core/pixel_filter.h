// By which weights the light around a pixel makes the pixel.
#pragma once

#include <string>

#include "engine/core/math.h"

namespace halflight {

/// The same in x and y, never negative, zero beyond the radius. Sample points are drawn from it by inverting its
/// distribution (Shirley 1990; pbrt-v4, 8.8), so that all samples of a pixel weigh alike.
struct PixelFilter {
    enum class Shape : std::uint8_t {
        box,
        blackman_harris,  // four terms (Harris 1978, table 1, -92 dB), stretched to the radius
    };
    Shape shape = Shape::box;
    double radius = 0.5;  // pixels from the pixel's centre, in x and y; (0, kMaxFilterRadius]

    bool operator==(const PixelFilter&) const = default;
};
inline constexpr double kMaxFilterRadius = 16;  ///< pixels

const char* name(PixelFilter::Shape shape);  ///< as of the command line
/// Box: 0.5. Blackman-Harris: 1.5, whose weights fall to a half at 0.51 pixels.
double usual_radius(PixelFilter::Shape shape);
/// "blackman-harris, radius 1.5 pixels".
std::string text(const PixelFilter& filter);

/// Point relative to the pixel's upper left corner, in pixels, for a uniform one of [0, 1)^2. The box of radius 0.5
/// gives back `xi`, bit for bit.
vec2 sample_point(const PixelFilter& filter, const vec2& xi);

}  // namespace halflight
