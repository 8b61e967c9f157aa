// The file of statistics of a sequence: a line of JSON for each frame.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "api/halflight/log.h"
#include "engine/core/frames.h"

namespace halflight {

/// Appends a line to a file. The last line may lack its newline if a run was killed. An empty `line` appends only
/// that missing newline and creates the file. Throws Error.
void append_line(const std::filesystem::path& path, const std::string& line);

/// Returns JSON as one line. Bytes of file names that are not UTF-8 are replaced.
std::string line_of(const nlohmann::ordered_json& json);

/// Appends the error of a missing frame to the statistics. A failure to write them does not stop other frames.
void add_failure(const std::filesystem::path& stats, FrameNumber frame, const std::string& what, const Log& log);

}  // namespace halflight
