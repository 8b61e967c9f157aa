// Radiance RGBE pictures. stb_image 2.27 is not used, because it never returns from a truncated file.
#pragma once

#include <string>
#include <string_view>

#include "engine/core/image.h"
#include "engine/io/exr.h"

namespace halflight {

struct RadiancePicture {
    Image image;          // RGB, linear, as stored: not divided by the header's exposure
    double exposure = 1;  // product of the header's EXPOSURE lines
};

bool is_radiance(std::string_view bytes);

/// Reads the format of Ward, "Real Pixels", Graphics Gems II, 1991, and the Radiance manual, "picture files": flat, old
/// and new run lengths, rows in either order. Throws Error with `subject` for damaged, truncated, XYZE and column-first
/// files, and for pictures beyond the limits, which are those of environments of any format.
RadiancePicture read_radiance(const std::string& subject, std::string_view bytes, const ExrLimits& limits);

}  // namespace halflight
