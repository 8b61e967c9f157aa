#include "tools/view/view_history.h"

#include <utility>

namespace halflight::view {
namespace {

constexpr std::size_t kMostViews = 1000;  // views to restore
constexpr double kRest = 0.4;        // time without a change after which a move has ended, seconds

}  // namespace

void ViewHistory::start(const View& now) {
    before_.clear(), after_.clear();
    current_ = seen_ = now;
    busy_ = false;
}

void ViewHistory::settle(const View& now) {
    seen_ = now;
    if (now == current_) return;
    before_.push_back(std::exchange(current_, now));
    if (before_.size() > kMostViews) before_.erase(before_.begin());
    after_.clear();
}

void ViewHistory::record(const View& now, double time, bool busy) {
    if (!busy_ && time - changed_ >= kRest)
        settle(View(seen_));  // the move has ended, although no frame has been drawn since
    if (busy || !(now == seen_)) changed_ = time;
    seen_ = now;
    busy_ = busy;
    if (time - changed_ >= kRest) settle(now);
}

std::optional<View> ViewHistory::back(const View& now) {
    settle(now);
    if (before_.empty()) return std::nullopt;
    after_.push_back(std::exchange(current_, before_.back()));
    before_.pop_back();
    return seen_ = current_;
}

std::optional<View> ViewHistory::forward(const View& now) {
    settle(now);
    if (after_.empty()) return std::nullopt;
    before_.push_back(std::exchange(current_, after_.back()));
    after_.pop_back();
    return seen_ = current_;
}

}  // namespace halflight::view
