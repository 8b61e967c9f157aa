#include "engine/rays/choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace halflight::rays {

Choice::Choice(std::vector<std::string> names, std::uint64_t first_runs)
    : names_(std::move(names)), first_runs_(first_runs) {
    forget();
}

void Choice::forget() {
    times_.clear();
    trial_.clear();
    best_ = 0;
    runs_left_ = first_runs_ - kFirstRuns;
    if (names_.size() > 1 && runs_left_ == 0) begin_trial();
}

void Choice::begin_trial() {
    // The current method is timed first, because a comparison needs its present time, too.
    trial_.assign(decided() ? 1 : kFirstRuns, best_);
    for (std::size_t method = 0; method < names_.size(); ++method) {
        if (method != best_) trial_.insert(trial_.end(), decided() ? kTrials - 1 : kTrials, method);
    }
    fastest_.assign(names_.size(), std::numeric_limits<double>::infinity());
}

std::size_t Choice::now() const {
    return trial_.empty() ? best_ : trial_.front();
}

void Choice::ran(double seconds) {
    if (names_.size() < 2) return;
    if (trial_.empty()) {
        if (--runs_left_ == 0) begin_trial();
        return;
    }
    double& fastest = fastest_[trial_.front()];
    fastest = std::min(fastest, seconds);
    trial_.pop_front();
    if (trial_.empty()) decide();
}

void Choice::decide() {
    times_ = fastest_;
    best_ = static_cast<std::size_t>(std::min_element(times_.begin(), times_.end()) - times_.begin());
    double second = std::numeric_limits<double>::infinity();
    for (std::size_t method = 0; method < times_.size(); ++method) {
        if (method != best_) second = std::min(second, times_[method]);
    }
    runs_left_ = second > kHopeless * times_[best_] ? 4 * kReexamine : kReexamine;
}

std::string Choice::reason() const {
    if (!decided())
        return on_trial() ? fmt::format("undecided: {} on trial", names_[now()])
                          : fmt::format("{} serves the first {} runs", names_[now()], first_runs_);
    std::string text;
    for (std::size_t method = 0; method < names_.size(); ++method) {
        if (method == best_) continue;
        text +=
            fmt::format("{}{:.2f} times as fast as {} (fastest runs: {:.1f} ms, {:.1f} ms)", text.empty() ? "" : ", ",
                        times_[method] / times_[best_], names_[method], 1e3 * times_[best_], 1e3 * times_[method]);
    }
    if (on_trial()) text += fmt::format("; {} on trial again", names_[now()]);
    return text;
}

}  // namespace halflight::rays
