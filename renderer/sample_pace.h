// Predicts when samples end, from the times of those before.
#pragma once

#include <algorithm>
#include <cstddef>

namespace halflight {

/// Times of the samples of a band. The first sample of a program also waits for shaders to be compiled, and then for
/// the driver to translate them. That says nothing about the time of others.
class SamplePace {
  public:
    /// Records one more sample. seconds: time since the first sample began. compiling: seconds of that in which
    /// shaders were compiled; those of the first sample count.
    void add(double seconds, double compiling) {
        if (samples_++ == 0) first_ = seconds, most_overhead_ = kTranslation * compiling;
        seconds_ = seconds;
    }
    /// Returns the seconds of the first sample that compiling may have taken: those above the mean of the other
    /// samples. These are all of them while there are no others.
    double overhead() const {
        const double others = samples_ < 2 ? 0 : (seconds_ - first_) / (samples_ - 1);
        return std::clamp(first_ - others, 0.0, most_overhead_);
    }
    /// Returns whether `more` samples are expected to end within `limit` seconds since the first began. The first one
    /// always fits: without it, nothing is known.
    bool another_fits(double limit, std::size_t more = 1) const {
        if (samples_ == 0) return true;
        return seconds_ + static_cast<double>(more) * (seconds_ - overhead()) / samples_ <= limit;
    }

  private:
    // Largest share of translation to compilation. It is 3 to 4 in Mesa's llvmpipe, which translates at dispatches.
    static constexpr double kTranslation = 8;
    int samples_ = 0;
    double first_ = 0, seconds_ = 0, most_overhead_ = 0;
};

}  // namespace halflight
