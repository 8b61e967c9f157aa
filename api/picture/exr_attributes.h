// Header of the .exr files of pictures.
#pragma once

#include <span>
#include <string>

#include "api/halflight/picture_file.h"
#include "engine/io/exr.h"
#include "renderer/render_result.h"

namespace halflight {

/// Returns the attributes of a picture, without its fingerprint and the names of views. whole: size of the whole
/// picture, pixels; of one view if there are several.
ExrAttributes exr_attributes(const RenderResult& result, const PictureInfo& info, const ivec2& whole);

/// Adds the fingerprint of a file that has these layers; an empty one adds nothing.
void add_fingerprint(ExrAttributes& attributes, const std::string& fingerprint, std::span<const ExrLayerView> layers);

}  // namespace halflight
