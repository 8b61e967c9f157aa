#include "tools/view/toasts.h"

#include <utility>

namespace halflight::view {
namespace {

constexpr double kShown = 4;      // seconds for which a message is shown
constexpr std::size_t kMost = 4;  // messages at once

}  // namespace

void Toasts::add(Toast toast) {
    ++total_;
    if (!toast.topic.empty()) std::erase_if(toasts_, [&](const Toast& t) { return t.topic == toast.topic; });
    if (!toasts_.empty() && toasts_.back().text == toast.text && toasts_.back().error == toast.error) {
        toasts_.back().until = toast.until;
        ++toasts_.back().count;
        return;
    }
    if (toasts_.size() == kMost) toasts_.erase(toasts_.begin());
    toasts_.push_back(std::move(toast));
}

void Toasts::tell(std::string text, double now, std::string topic) {
    add({.text = std::move(text), .until = now + kShown, .topic = std::move(topic)});
}

void Toasts::fail(std::string text, double now) {
    add({.text = std::move(text), .error = true, .until = now});
}

bool Toasts::expire(double now) {
    return std::erase_if(toasts_, [&](const Toast& t) { return !t.error && t.until <= now; }) > 0;
}

}  // namespace halflight::view
