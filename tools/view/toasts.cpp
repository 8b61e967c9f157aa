#include "tools/view/toasts.h"

#include <utility>

namespace halflight::view {
namespace {

constexpr double kShown = 4;         // seconds for which a message is shown
constexpr std::size_t kMost = 4;     // messages at once

}  // namespace

void Toasts::add(std::string text, bool error, double until) {
    ++total_;
    if (!toasts_.empty() && toasts_.back().text == text && toasts_.back().error == error) {
        toasts_.back().until = until;
        ++toasts_.back().count;
        return;
    }
    if (toasts_.size() == kMost) toasts_.erase(toasts_.begin());
    toasts_.push_back({std::move(text), error, until});
}

void Toasts::tell(std::string text, double now) {
    add(std::move(text), false, now + kShown);
}

void Toasts::fail(std::string text, double now) {
    add(std::move(text), true, now);
}

bool Toasts::expire(double now) {
    return std::erase_if(toasts_, [&](const Toast& t) { return !t.error && t.until <= now; }) > 0;
}

}  // namespace halflight::view
