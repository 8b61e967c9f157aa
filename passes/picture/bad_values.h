// How often passes got a value wrong.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "shaders/shared/path.h"

namespace halflight {

inline constexpr std::size_t kBadValueCounts = shared::kCountedPasses * shared::kBadKinds;

/// Values that a pass got wrong: replaced by zero before accumulation, so that none gets into a sum.
struct BadValues {
    std::string component;
    std::uint64_t nans = 0;
    std::uint64_t infinities = 0;
    std::uint64_t negatives = 0;  // of radiance
    std::uint64_t total() const { return nans + infinities + negatives; }
};

/// Kernels count those of one sample of a band in 32 bits, which cannot wrap: there are fewer values. A picture has any
/// number of samples.
class BadValueSums {
  public:
    void reset() { sums_ = {}; }
    /// counts: of one sample, as shaders/shared/path.h lays them out.
    void add(std::span<const std::uint32_t, kBadValueCounts> counts);
    /// By component.
    std::vector<BadValues> told() const;

  private:
    std::array<std::uint64_t, kBadValueCounts> sums_{};
};

}  // namespace halflight
