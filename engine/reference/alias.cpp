#include "engine/reference/alias.h"

#include <algorithm>
#include <numeric>

namespace halflight::reference {

AliasTable::AliasTable(const std::vector<double>& weights) {
    const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
    if (!(sum > 0)) return;
    const std::size_t count = weights.size();
    entries_.resize(count);
    std::vector<double> height(count);  // weight of each entry, in slots
    std::vector<std::size_t> low, high;
    for (std::size_t i = 0; i < count; ++i) {
        entries_[i] = {1, i, weights[i] / sum};
        height[i] = entries_[i].probability * static_cast<double>(count);
        (height[i] < 1 ? low : high).push_back(i);
    }
    while (!low.empty() && !high.empty()) {
        const std::size_t poor = low.back(), rich = high.back();
        low.pop_back();
        entries_[poor].keep = height[poor];
        entries_[poor].alias = rich;
        height[rich] -= 1 - height[poor];
        if (height[rich] < 1) {
            high.pop_back();
            low.push_back(rich);
        }
    }
    // The remaining slots are full except for rounding; a slot without weight must not keep any share.
    for (const std::size_t i : low) {
        if (weights[i] == 0) {
            entries_[i].keep = 0;
            entries_[i].alias =
                static_cast<std::size_t>(std::max_element(weights.begin(), weights.end()) - weights.begin());
        }
    }
}

std::size_t AliasTable::choose(double& u) const {
    const double scaled = u * static_cast<double>(entries_.size());
    const std::size_t slot = std::min(static_cast<std::size_t>(scaled), entries_.size() - 1);
    const double rest = std::min(scaled - static_cast<double>(slot), 0x1.fffffffffffffp-1);
    const Entry& entry = entries_[slot];
    if (rest < entry.keep) {
        u = rest / entry.keep;
        return slot;
    }
    u = (rest - entry.keep) / (1 - entry.keep);
    return entry.alias;
}

}  // namespace halflight::reference
