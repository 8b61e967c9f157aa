// Writes the measurements of ray sets as tables and as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "tools/measure/bench/bench.h"
#include "tools/measure/bench/measure.h"

namespace halflight::bench {

inline constexpr int kSchema = 3;  // version of the JSON's layout

struct SceneResult {
    std::string file;
    std::string camera;
    ivec2 size{0};
    rays::TraceStatistics statistics;
    double embree_build_seconds = 0;
    std::vector<std::string> left_out;  // lines "method: why it cannot take the scene", "kind: no rays"
    std::vector<KindResult> kinds;

    /// Returns the number of rays for which an exact method differs from the plain tracer.
    std::size_t disagreements() const;
};

/// Returns lines with a row per kind and a column per method. Rates are medians. Ratios are taken turn by turn; their
/// median is followed by their quartiles.
std::string table(const SceneResult& result, Clock clock);
nlohmann::json json(const SceneResult& result, Clock clock);

}  // namespace halflight::bench
