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
struct MemoryRow {
    const char* name;
    std::string size;
    const char* help;
};
/// Returns the memory in use on the device, the memory left out, the program's peak, and what the budget has left.
std::vector<MemoryRow> memory_rows(const RenderStats& stats);

}  // namespace halflight::view
