#include "engine/rays/choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace halflight::rays {

Choice::Choice(std::vector<std::string> names) : names_(std::move(names)) {
    forget();
}

void Choice::forget() {
    fastest_.assign(names_.size(), std::numeric_limits<double>::infinity());
    times_.clear();
    trial_.clear();
    best_ = 0;
    if (names_.size() < 2) return;
    trial_.assign(kFirstRuns, 0);
    for (std::size_t method = 1; method < names_.size(); ++method) trial_.insert(trial_.end(), kTrials, method);
}

std::size_t Choice::now() const {
    return trial_.empty() ? best_ : trial_.front();
}

void Choice::ran(double seconds) {
    if (names_.size() < 2) return;
    if (trial_.empty()) {
        if (--runs_left_ > 0) return;
        // The current method comes first, because its time must be up to date, too.
        trial_ = {best_};
        for (std::size_t method = 0; method < names_.size(); ++method) {
            if (method != best_) trial_.insert(trial_.end(), kTrials - 1, method);
        }
        fastest_.assign(names_.size(), std::numeric_limits<double>::infinity());
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
    if (!decided()) return fmt::format("undecided: {} on trial", names_[now()]);
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
