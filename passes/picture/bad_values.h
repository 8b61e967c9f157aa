// Counts of NaNs, infinities and negative values by pass.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "shaders/shared/path_state.h"

namespace halflight {

inline constexpr std::size_t kBadValueCounts = shared::kCountedPasses * shared::kBadKinds;

/// Invalid values of one component. They are replaced by zero before accumulation.
struct BadValues {
    std::string component;
    std::uint64_t nans = 0;
    std::uint64_t infinities = 0;
    std::uint64_t negatives = 0;  // number of negative radiances
    std::uint64_t total() const { return nans + infinities + negatives; }
};

/// Sums of invalid values over the samples of a picture. Kernels count one sample of a band in 32 bits, which cannot
/// overflow.
class BadValueSums {
  public:
    void reset() { sums_ = {}; }
    /// Returns the sums of each component by kind, kBadValueCounts numbers.
    std::span<const std::uint64_t> all() const { return sums_; }
    /// Sets the sums to those of all().
    void set(std::span<const std::uint64_t, kBadValueCounts> sums) { std::ranges::copy(sums, sums_.begin()); }
    /// Adds the counts of one sample, laid out as in shaders/shared/path_state.h.
    void add(std::span<const std::uint32_t, kBadValueCounts> counts);
    /// Returns the sums, one element per component.
    std::vector<BadValues> by_component() const;

  private:
    std::array<std::uint64_t, kBadValueCounts> sums_{};
};

}  // namespace halflight
