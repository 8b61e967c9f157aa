// Declarations shared by `halflight render` and its sequences.
#pragma once

#include <string_view>

#include "api/halflight/frame_renderer.h"
#include "tools/cli/console.h"
#include "tools/cli/picture_arguments.h"

namespace halflight {

/// Returns whether an output is an .exr.
bool has_exr(const RenderArguments& arguments);
/// Returns whether an output needs the picture through the view transform.
bool wants_view(const RenderArguments& arguments);

/// Loads the scene of the arguments. If it has to be converted to pages first, shows the progress, and throws
/// Interrupted if a signal asks to stop.
LoadedScene load_scene(const RenderArguments& arguments, const Console& console);

/// Returns the settings of a picture by this camera. The arguments decide size, view and statistics.
RenderSettings make_settings(const RenderArguments& arguments, const Camera& chosen);

/// Returns the memory that every picture of these arguments takes, bytes, as far as it is known without the scene.
std::size_t picture_bytes(const RenderArguments& arguments);

/// Returns the options that open the device of the arguments.
gpu::ContextOptions device_options(const RenderArguments& arguments);

/// Throws Error if the config lacks the view or the working space of the arguments. Warns of a working space whose
/// primaries files cannot tell.
void check_color(const ColorConfig& config, const RenderArguments& arguments, const Console& console);

}  // namespace halflight
