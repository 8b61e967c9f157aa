// Selection of the fastest of several methods for the same work by trials. Neither OpenGL nor a clock is used.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

namespace halflight::rays {

/// Method selection. The first method serves the first runs: it is known to be good, and short jobs end before a trial
/// could pay. Then the other methods are tried, and the one with the fastest run is selected. Trials are
/// repeated from time to time, because the work changes.
class Choice {
  public:
    static constexpr std::uint64_t kFirstRuns = 4;  ///< Runs before the first trial of other methods, at least.
    /// Runs per trial of each other method: the first run of tiles makes their lists, the second one widens them, the
    /// third one reuses them.
    static constexpr int kTrials = 3;
    /// Runs between a decision and the next trial; four times as many if the slower method took more than kHopeless
    /// times as long.
    static constexpr std::uint64_t kReexamine = 64;
    static constexpr double kHopeless = 1.3;

    /// Starts with the first method. `names` has at least one name, for reason(). first_runs: runs of the first
    /// method, >= kFirstRuns, of which the last kFirstRuns are timed.
    explicit Choice(std::vector<std::string> names, std::uint64_t first_runs = kFirstRuns);

    std::size_t now() const;  ///< Returns the index of the method for the next run.
    /// Returns whether the time of the next run is needed; never with one method.
    bool on_trial() const { return !trial_.empty(); }
    /// Records the end of a run by now(); `seconds` is used if it was on_trial().
    void ran(double seconds);
    std::string reason() const;
    void forget();

  private:
    void begin_trial();
    void decide();
    bool decided() const { return !times_.empty(); }

    std::vector<std::string> names_;
    std::uint64_t first_runs_;
    std::deque<std::size_t> trial_;  // methods of the next timed runs
    std::vector<double> fastest_;    // seconds, fastest run of each method in this trial
    std::vector<double> times_;      // seconds, fastest runs in the last finished trial
    std::size_t best_ = 0;
    std::uint64_t runs_left_ = 0;  // runs until the next trial
};

}  // namespace halflight::rays
