// File names of sequences: "shot.####.exr" and "shot.%04d.exr" mean shot.0001.exr and so on.
#pragma once

#include <filesystem>

#include "engine/core/frames.h"

namespace halflight {

/// Returns the number of placeholders in the file's name: runs of #, %d, %0Nd. Folders are ignored.
int count_placeholders(const std::filesystem::path& pattern);

/// Returns the name with its only placeholder replaced by the frame's number, zero-padded to the number of #, or to N
/// characters. Longer numbers are not truncated. Frame -5 is "-0005" for ####, and "-005" for %04d, as in C.
std::filesystem::path frame_path(const std::filesystem::path& pattern, FrameNumber frame);

}  // namespace halflight
