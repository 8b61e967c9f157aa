#include "tools/view/edit_history.h"

#include <utility>

namespace halflight::view {
namespace {

constexpr std::size_t kMostStates = 1000;  // states to undo

}  // namespace

void EditHistory::start(SavedSettings now) {
    before_.clear();
    after_.clear();
    saved_ = now;
    current_ = std::move(now);
}

void EditHistory::record(const SavedSettings& now, bool busy) {
    if (busy && !before_.empty() && now == before_.back()) {  // a control has taken back its own change
        current_ = now;
        before_.pop_back();
    }
    if (busy || now == current_) return;
    before_.push_back(std::exchange(current_, now));
    if (before_.size() > kMostStates) before_.erase(before_.begin());
    after_.clear();
}

void EditHistory::meter(float stops) {
    if (!current_.settings.view.metered()) return;
    const bool is_saved = current_ == saved_;
    current_.settings.view.exposure = stops;
    if (is_saved) saved_ = current_;
    if (!before_.empty() && current_ == before_.back()) before_.pop_back();  // the step has changed nothing
}

std::optional<SavedSettings> EditHistory::undo() {
    if (before_.empty()) return std::nullopt;
    after_.push_back(std::exchange(current_, std::move(before_.back())));
    before_.pop_back();
    return current_;
}

std::optional<SavedSettings> EditHistory::redo() {
    if (after_.empty()) return std::nullopt;
    before_.push_back(std::exchange(current_, std::move(after_.back())));
    after_.pop_back();
    return current_;
}

}  // namespace halflight::view
