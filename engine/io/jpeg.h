// JPEG files to texels, by libjpeg-turbo.
#pragma once

#include <string>
#include <string_view>

#include "engine/scene/scene.h"

namespace halflight {

bool is_jpeg(std::string_view bytes);

/// Fills size and texels of `image` from a grey or colour JPEG, whatever its profile says. Throws Error whose subject
/// is `subject`: truncated, damaged, CMYK, larger than `max_side` on a side.
void read_jpeg(const std::string& subject, std::string_view bytes, int max_side, TextureImage& image);

}  // namespace halflight
