// Short messages to the user about actions that have happened. Uses no window.
#pragma once

#include <string>
#include <vector>

namespace halflight::view {

/// Messages that disappear after some seconds, errors later than others unless they are dismissed.
class Toasts {
  public:
    struct Toast {
        std::string text;
        bool error = false;
        double until = 0;     // time at which it disappears, seconds
        int count = 1;        // how often the same message has come
        std::string topic{};  // subject of which only the last message counts; empty: none
    };
    /// Adds a message at `now`, seconds. It replaces the message of the same topic. A message that is shown already is
    /// counted instead.
    void tell(std::string text, double now, std::string topic = {});
    void fail(std::string text, double now);
    /// Removes messages whose time is over; returns whether any was removed.
    bool expire(double now);
    void dismiss(std::size_t index) { toasts_.erase(toasts_.begin() + static_cast<std::ptrdiff_t>(index)); }
    const std::vector<Toast>& all() const { return toasts_; }  ///< Returns the messages, oldest first.
    /// Returns the number of all messages so far, repeated ones included.
    std::size_t total() const { return total_; }

  private:
    void add(Toast toast);
    std::vector<Toast> toasts_;
    std::size_t total_ = 0;
};

}  // namespace halflight::view
