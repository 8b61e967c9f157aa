// Radiance RGBE pictures. Our own reader, because stb_image 2.27 never returns from a file that ends too early.
#pragma once

#include <string>
#include <string_view>

#include "engine/core/image.h"

namespace halflight {

struct RadiancePicture {
    Image image;          // RGB, linear, as stored: the header's exposure is not divided out
    double exposure = 1;  // product of the header's EXPOSURE lines
};

bool is_radiance(std::string_view bytes);

/// Format: Ward, "Real Pixels", Graphics Gems II, 1991; Radiance manual, "picture files": flat, old and new run
/// lengths, rows in either order. Error, naming `subject`: damaged, truncated, XYZE, columns first, beyond `max_side`
/// pixels.
RadiancePicture read_radiance(const std::string& subject, std::string_view bytes, int max_side);

}  // namespace halflight
