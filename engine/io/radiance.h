// Radiance RGBE pictures. stb_image 2.27 is not used, because it never returns from a truncated file.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/core/chromaticities.h"
#include "engine/core/image.h"
#include "engine/io/exr.h"

namespace halflight {

struct RadiancePicture {
    Image image;  // RGB or XYZ, linear, as stored: not divided by the header's exposure
    std::optional<Chromaticities>
        primaries;  // primaries of the line PRIMARIES, or of CIE XYZ; none: the header has no such line
    std::vector<std::string> notes;  // lines of the header that are not applied, a phrase each
};

bool is_radiance(std::string_view bytes);

/// Reads the format of Ward, "Real Pixels", Graphics Gems II, 1991, and the Radiance manual, "picture files": flat, old
/// and new run lengths, RGBE and XYZE, all eight orders of pixels. Throws Error with `subject` for damaged and
/// truncated files, and for pictures beyond the limits, which are those of environments of any format.
RadiancePicture read_radiance(const std::string& subject, std::string_view bytes, const ExrLimits& limits);

}  // namespace halflight
