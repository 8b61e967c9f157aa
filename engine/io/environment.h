// Equirectangular environment maps from OpenEXR (.exr) and Radiance (.hdr, .pic) files.
#pragma once

#include <filesystem>
#include <functional>

#include "engine/io/exr.h"
#include "engine/scene/scene.h"

namespace halflight {

/// Loads a map; the format is detected by content, not by extension. An EXR has R G B or luminance (Y). Its display
/// window is the sphere, or its data window if it has the attribute envmap; a cube map is resampled. Other primaries
/// than Rec.709 are converted. A map that is not 2:1 is stretched, with a warning. Repairs are counted in `report`: NaN
/// and negative values become 0, infinities become the map's largest finite value. A black map gives a black
/// environment without a map. Throws Error for unreadable, damaged, truncated and oversized files, and for files
/// without light.
Environment load_environment(const std::filesystem::path& path, SceneReport& report, const ExrLimits& limits = {});

/// Returns the equirectangular map of a cube map, 4 by 2 times `face_size`: around the horizon, it has the pixels of
/// four faces. `radiance` returns what a direction of the world, a unit vector, shows; its calls are concurrent. Each
/// texel is the mean of 2 x 2 directions.
Image equirectangular(int face_size, const std::function<vec3(const dvec3&)>& radiance);

}  // namespace halflight
