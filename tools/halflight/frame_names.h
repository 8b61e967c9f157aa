// Names of a sequence's files: "shot.####.exr" and "shot.%04d.exr" stand for shot.0001.exr and so on.
#pragma once

#include <cstdint>
#include <filesystem>

namespace halflight {

/// How many placeholders the file's name has (its folders are not looked at): runs of #, %d, %0Nd.
int count_placeholders(const std::filesystem::path& pattern);

/// The name with its only placeholder replaced by the frame's number, with zeros in front up to as many digits as there
/// are #, or N. Longer numbers stay whole.
std::filesystem::path frame_path(const std::filesystem::path& pattern, std::uint32_t frame);

}  // namespace halflight
