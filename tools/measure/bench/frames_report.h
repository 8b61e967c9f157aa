// Writes the measurements of whole frames as tables and as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "tools/measure/bench/bench.h"
#include "tools/measure/bench/frames.h"

namespace halflight::bench {

struct FrameReport {
    std::string file;
    std::string camera;
    FrameOrder order;
    FrameResult result;
};

/// Returns lines of medians, followed by quartiles, and of ratios to the first variant, frame by frame. "later" is all
/// but the first frame, "settled" all but the first eight, in which Culling::automatic makes its trials.
std::string table(const FrameReport& report, Clock clock);
nlohmann::json json(const FrameReport& report, Clock clock);

}  // namespace halflight::bench
