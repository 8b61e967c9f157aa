// Which of several ways to do the same work is the fastest one, by trial and by trial again. No OpenGL, no clock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

namespace halflight::rays {

/// The first way is known to be good and serves the first kFirstRuns runs; short jobs end before anything else could
/// pay. Then the others are tried, and the one with the fastest run stays. What was so is looked at again now and then:
/// work changes, and a way that is left alone would be judged by what it once was.
class Choice {
  public:
    static constexpr int kFirstRuns = 4;
    /// Of the others: the first run of tiles makes their lists, the second one widens them, the third one finds them.
    static constexpr int kTrials = 3;
    /// Runs from a decision to the next trial; four times as many where the loser took more than kHopeless as long.
    static constexpr std::uint64_t kReexamine = 64;
    static constexpr double kHopeless = 1.3;

    /// names: at least one; for reason().
    explicit Choice(std::vector<std::string> names);

    std::size_t now() const;  ///< the way of the next run
    /// Whether it matters how long the next run takes: never where there is but one way.
    bool on_trial() const { return !trial_.empty(); }
    /// A run by now() is over; `seconds` counts if it was on_trial().
    void ran(double seconds);
    std::string reason() const;
    void forget();

  private:
    void decide();
    bool decided() const { return !times_.empty(); }

    std::vector<std::string> names_;
    std::deque<std::size_t> trial_;  // ways of the next runs, whose times count
    std::vector<double> fastest_;    // run of each way in this trial, seconds
    std::vector<double> times_;      // the same of the last trial that ended
    std::size_t best_ = 0;
    std::uint64_t runs_left_ = 0;  // until the next trial
};

}  // namespace halflight::rays
