#include "passes/picture/bad_values.h"

namespace halflight {

void BadValueSums::add(std::span<const std::uint32_t, kBadValueCounts> counts) {
    for (std::size_t i = 0; i < counts.size(); ++i) sums_[i] += counts[i];
}

std::vector<BadValues> BadValueSums::by_component() const {
    const char* names[shared::kCountedPasses] = {"gbuffer", "shadow", "diffuse and glossy", "continuation",
                                                 "path reuse"};
    std::vector<BadValues> all;
    for (std::size_t i = 0; i < shared::kCountedPasses; ++i) {
        const std::uint64_t* of = &sums_[i * shared::kBadKinds];
        all.push_back({names[i], of[shared::kBadNan], of[shared::kBadInfinite], of[shared::kBadNegative]});
    }
    return all;
}

}  // namespace halflight
