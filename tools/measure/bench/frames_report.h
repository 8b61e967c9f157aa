// What was measured of whole frames, as tables and as JSON.
#pragma once

#include <nlohmann/json.hpp>
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

/// Times are medians, followed by quartiles; ratios are to the first variant, frame by frame. "later": all but the
/// first frame; "settled": without the first eight, in which Culling::automatic tries what there is.
std::string table(const FrameReport& report, Clock clock);
nlohmann::json json(const FrameReport& report, Clock clock);

}  // namespace halflight::bench
