// What was measured, as tables and as JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/measure/bench/bench.h"
#include "tools/measure/bench/measure.h"

namespace halflight::bench {

inline constexpr int kSchema = 3;  // of the JSON

struct SceneResult {
    std::string file;
    std::string camera;
    ivec2 size{0};
    rays::TraceStatistics statistics;
    double embree_build_seconds = 0;
    std::vector<std::string> left_out;  // "method: why it cannot take the scene", "kind: no rays"
    std::vector<KindResult> kinds;

    /// Rays whose answers are wrong: of exact methods, those that are not the plain tracer's.
    std::size_t disagreements() const;
};

/// Lines of text: a row per kind, a column per method. Rates are medians; ratios are taken turn by turn, their median
/// is followed by their quartiles.
std::string table(const SceneResult& result, Clock clock);
nlohmann::json json(const SceneResult& result, Clock clock);

}  // namespace halflight::bench
