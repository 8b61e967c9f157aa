// What single pictures and frames of sequences have in common.
#pragma once

#include <string>

#include "engine/core/stopwatch.h"
#include "renderer/render.h"
#include "tools/halflight/arguments.h"
#include "tools/halflight/console.h"
#include "tools/halflight/picture.h"

namespace halflight {

/// Whether any output has this extension.
bool wants(const RenderArguments& arguments, std::string_view extension);

/// The space of colour in the .exr. Throws Error where the config has none of that name.
LinearSpace working_space(const ColorConfig& config, const RenderArguments& arguments);

/// Those of one picture by this camera, of frame arguments.frame.
RenderSettings make_settings(const RenderArguments& arguments, const Camera& camera);

/// What its file tells of a picture; of a frame of a sequence the rest is to be added.
PictureInfo picture_info(const RenderArguments& arguments, const RenderSettings& settings, const LinearSpace& space,
                         const Scene& scene, const RenderStats& stats, const std::string& error);

/// Sees that a picture is good enough to be written, and says on the console what is remarkable. Returns the error
/// that it has in words, empty where it is not known. Throws Error about `output` where nothing is to be written: bad
/// values and --strict, an error that was not reached.
std::string judge(const RenderArguments& arguments, const RenderStats& stats, const std::filesystem::path& output,
                  const Console& console);

}  // namespace halflight
