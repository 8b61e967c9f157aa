// What there is to tell of a picture's making, line by line.
#pragma once

#include <string>
#include <vector>

#include "renderer/render.h"

namespace halflight::view {

/// By batch: how it is traced and why. With RenderSettings::measure also pairs of tile and node, how many of the lists
/// were still good from earlier samples (state hits), how many rays a remembered leaf has ended; by occlusion queries
/// these, and the nodes tested and leaves hit.
std::vector<std::string> culling_lines(const RenderStats& stats);
/// What the picture does without, why, and how much memory that saves.
std::vector<std::string> left_out_lines(const RenderStats& stats);
/// On the device and, at most so far, of the program.
std::vector<std::string> memory_lines(const RenderStats& stats);

}  // namespace halflight::view
