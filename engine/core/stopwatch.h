// Durations of work, by the wall clock and by the CPU clock.
#pragma once

#include <chrono>
#include <utility>

namespace halflight {

/// Duration of some work, seconds.
struct Seconds {
    double wall = 0;
    double cpu = 0;  // CPU time of the process, all threads
};

/// Returns the CPU time of the process so far, all threads, seconds.
double cpu_seconds();

/// Clock of the wall time since its construction; it never goes back.
class Stopwatch {
  public:
    double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
    /// Returns the seconds since the last lap, at first since construction, and begins a new lap.
    double lap() {
        const double now = seconds();
        return now - std::exchange(lap_, now);
    }

  private:
    using Clock = std::chrono::steady_clock;
    Clock::time_point start_ = Clock::now();
    double lap_ = 0;
};

/// Clock of the wall time and the CPU time since its construction.
class CpuStopwatch {
  public:
    Seconds seconds() const { return {wall_.seconds(), cpu_seconds() - cpu_}; }

  private:
    Stopwatch wall_;
    double cpu_ = cpu_seconds();
};

}  // namespace halflight
