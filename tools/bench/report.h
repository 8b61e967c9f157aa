// What was measured, as a table and as JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/bench/measure.h"

namespace halflight::bench {

struct SceneResult {
    std::string file;
    int width = 0;
    int height = 0;
    rays::TraceStatistics statistics;
    double embree_build_seconds = 0;
    std::vector<KindResult> kinds;
};

/// Lines of text. Mrays/s are medians over wall time; "spread" is half the distance of the quartiles by the median; the
/// ratio by CPU time is the one to trust where the machine is shared.
std::string table(const SceneResult& result);
nlohmann::json json(const SceneResult& result);

}  // namespace halflight::bench
