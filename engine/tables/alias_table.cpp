#include "engine/tables/alias_table.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

namespace halflight {
namespace {

constexpr double kSteps = 0x1p24;

/// Rounds to the nearest step, but to 0 or 1 only if the value is 0 or 1: every entry must stay reachable.
float quantized(double threshold) {
    if (threshold <= 0) return 0;
    if (threshold >= 1) return 1;
    return static_cast<float>(std::clamp(std::round(threshold * kSteps), 1.0, kSteps - 1) / kSteps);
}

}  // namespace

AliasTable build_alias_table(std::span<const double> weights) {
    const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
    assert(sum > 0 && std::isfinite(sum));
    const std::size_t count = weights.size();
    const auto heaviest =
        static_cast<std::uint32_t>(std::max_element(weights.begin(), weights.end()) - weights.begin());

    std::vector<double> scaled(count);
    std::vector<std::uint32_t> poor, rich;  // indices of weights below and above the average
    for (std::uint32_t i = 0; i < count; ++i) {
        scaled[i] = weights[i] / sum * static_cast<double>(count);
        (scaled[i] < 1 ? poor : rich).push_back(i);
    }
    AliasTable table;
    table.entries.resize(count);
    for (std::uint32_t i = 0; i < count; ++i) table.entries[i].alias = i;
    while (!poor.empty() && !rich.empty()) {
        const std::uint32_t i = poor.back();
        const std::uint32_t donor = rich.back();
        poor.pop_back();
        table.entries[i] = {quantized(scaled[i]), donor};
        scaled[donor] -= 1 - scaled[i];
        if (scaled[donor] < 1) {
            rich.pop_back();
            poor.push_back(donor);
        }
    }
    // The remaining entries have weight 1 up to rounding, or exactly 0.
    for (const std::uint32_t i : poor) {
        if (weights[i] == 0) table.entries[i] = {0, heaviest};
    }

    table.probabilities.assign(count, 0);
    for (std::uint32_t i = 0; i < count; ++i) {
        const double keep = table.entries[i].threshold;
        table.probabilities[i] += keep / static_cast<double>(count);
        table.probabilities[table.entries[i].alias] += (1 - keep) / static_cast<double>(count);
    }
    return table;
}

}  // namespace halflight
