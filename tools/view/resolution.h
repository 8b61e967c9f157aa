// How coarse the first picture of a view must be to be there in time. No OpenGL, no clock.
#pragma once

#include <cstddef>
#include <map>

#include "engine/core/math.h"

namespace halflight::view {

inline constexpr int kCoarsest = 16;

/// Every divisor-th pixel of a picture, in both directions, at least one.
ivec2 divided(const ivec2& size, int divisor);

class Resolution {
  public:
    /// Seconds, > 0.
    explicit Resolution(double budget) : budget_(budget) {}

    /// The finest of 1, 2, 4, 8, 16 of which a sample of the whole picture is expected within the budget; 16 where none
    /// is, and 8 while nothing is known.
    int divisor(const ivec2& size) const;
    /// A picture of one sample took so long. What is known of other sizes counts a little less from then on, so that
    /// they are tried again some time.
    void took(const ivec2& size, double seconds);
    /// Another scene, other settings.
    void forget() { seconds_.clear(); }

  private:
    double expected(std::size_t pixels) const;
    double budget_;
    std::map<std::size_t, double> seconds_;  // by number of pixels, smoothed
};

}  // namespace halflight::view
