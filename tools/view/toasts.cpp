#include "tools/view/toasts.h"

#include <algorithm>
#include <utility>

namespace halflight::view {
namespace {

constexpr double kShown = 4;      // seconds for which a message is shown
constexpr double kFailure = 20;   // seconds for which an error is shown
constexpr std::size_t kMost = 4;  // messages at once

}  // namespace

void Toasts::add(Toast toast) {
    ++total_;
    if (!toast.topic.empty()) std::erase_if(toasts_, [&](const Toast& t) { return t.topic == toast.topic; });
    const auto same =
        std::ranges::find_if(toasts_, [&](const Toast& t) { return t.text == toast.text && t.error == toast.error; });
    if (same != toasts_.end()) {
        toast.count = same->count + 1;
        toasts_.erase(same);
    }
    if (toasts_.size() == kMost) toasts_.erase(toasts_.begin());
    toasts_.push_back(std::move(toast));
}

void Toasts::tell(std::string text, double now, std::string topic) {
    add({.text = std::move(text), .until = now + kShown, .topic = std::move(topic)});
}

void Toasts::fail(std::string text, double now) {
    add({.text = std::move(text), .error = true, .until = now + kFailure});
}

bool Toasts::expire(double now) {
    return std::erase_if(toasts_, [&](const Toast& t) { return t.until <= now; }) > 0;
}

}  // namespace halflight::view
