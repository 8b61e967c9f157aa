// Chooses the resolution of a view's first picture so that it is ready in time. Uses neither OpenGL nor a clock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>

#include "engine/core/math.h"

namespace halflight::view {

inline constexpr int kCoarsest = 16;

/// Returns the size of a picture of every divisor-th pixel in both directions, at least 1x1.
ivec2 divided(const ivec2& size, int divisor);

/// Returns whether a finer picture is worth its time after one that took `seconds` at `divisor`. The whole picture
/// takes about divisor^2 times as long. It comes next if that is at most four budgets.
bool worth_finer(double seconds, int divisor, double budget);

class Resolution {
  public:
    /// budget: time of a view's first picture, seconds, > 0.
    explicit Resolution(double budget) : budget_(budget) {}

    /// Returns the smallest divisor of 1, 2, 4, 8, 16 with which one sample of the whole picture is expected within the
    /// budget. Returns 16 if none is, and 8 while nothing has been recorded.
    int divisor(const ivec2& size) const;
    /// Records the time of a picture of one sample. Recorded times of other sizes fade a little, so that they are tried
    /// again after some time.
    void record(const ivec2& size, double seconds);
    /// Forgets all times, for another scene or other settings.
    void reset() { recorded_.clear(); }

  private:
    double expected_seconds(std::size_t pixels) const;
    double budget_;
    struct Recorded {
        double seconds;      // smoothed time of a picture
        std::uint64_t when;  // number of the record
    };
    std::map<std::size_t, Recorded> recorded_;  // keyed by number of pixels
    std::uint64_t records_ = 0;
};

}  // namespace halflight::view
