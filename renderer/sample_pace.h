// Predicts when samples end, from the times of those before.
#pragma once

#include <algorithm>

namespace halflight {

/// Times of the samples of a band. The first sample of a program also waits for shaders to be compiled, which says
/// nothing about the time of others.
class SamplePace {
  public:
    /// Takes up one more sample. seconds: time since the first sample began. compiled: some shader was compiled since.
    void add(double seconds, bool compiled) {
        if (samples_++ == 0) first_ = seconds, compiled_ = compiled;
        seconds_ = seconds;
    }
    /// Returns the seconds of the first sample that compiling may have taken: those above the mean of the other
    /// samples. These are all of them while there are no others.
    double overhead() const {
        if (!compiled_) return 0;
        return samples_ == 1 ? first_ : std::max(first_ - (seconds_ - first_) / (samples_ - 1), 0.0);
    }
    /// Returns whether one more sample is expected to end within `limit` seconds since the first began. At least one
    /// sample was added.
    bool another_fits(double limit) const { return seconds_ + (seconds_ - overhead()) / samples_ <= limit; }

  private:
    int samples_ = 0;
    double first_ = 0, seconds_ = 0;
    bool compiled_ = false;
};

}  // namespace halflight
