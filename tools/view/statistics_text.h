// Statistics of a picture as lines of text.
#pragma once

#include <string>
#include <vector>

#include "renderer/render.h"

namespace halflight::view {

/// Returns trace method and reason of each batch of rays. RenderSettings::measure adds pairs of tile and node, the
/// share of tile lists kept from earlier samples (state hits), and the share of rays ended by a remembered leaf. Raster
/// culling adds its occlusion queries, nodes tested and leaves hit.
std::vector<std::string> culling_lines(const RenderStats& stats);
/// Returns the traffic of pages; empty for scenes in memory.
std::vector<std::string> paging_lines(const RenderStats& stats);
/// Returns the parts left out of the picture's rendering, the reasons, and the memory saved.
std::vector<std::string> left_out_lines(const RenderStats& stats);
/// Returns the memory in use on the device, and the peak memory of the program.
std::vector<std::string> memory_lines(const RenderStats& stats);

}  // namespace halflight::view
