// Notes and warnings of the library. The library itself prints nothing.
#pragma once

#include <fmt/format.h>

#include <functional>
#include <string_view>
#include <utility>

namespace halflight {

/// Receives details, notes and warnings, one line of text each. A default Log discards them. Copies are cheap.
class Log {
  public:
    enum class Kind { detail, note, warning };
    using Sink = std::function<void(Kind kind, std::string_view line)>;

    Log() = default;
    explicit Log(Sink sink) : sink_(std::move(sink)) {}

    template <class... Args>
    void detail(fmt::format_string<Args...> format, Args&&... args) const {
        if (sink_) sink_(Kind::detail, fmt::format(format, std::forward<Args>(args)...));
    }
    template <class... Args>
    void note(fmt::format_string<Args...> format, Args&&... args) const {
        if (sink_) sink_(Kind::note, fmt::format(format, std::forward<Args>(args)...));
    }
    template <class... Args>
    void warn(fmt::format_string<Args...> format, Args&&... args) const {
        if (sink_) sink_(Kind::warning, fmt::format(format, std::forward<Args>(args)...));
    }
    /// Passes a message of another Log on.
    void pass(Kind kind, std::string_view line) const {
        if (sink_) sink_(kind, line);
    }

  private:
    Sink sink_;
};

}  // namespace halflight
