// What the program says on stderr: notes and warnings, one line each. Errors are shown by main().
#pragma once

#include <fmt/format.h>

#include <string>
#include <string_view>

namespace halflight {

/// `text` with control characters replaced, so that it stays one line whatever names it quotes.
std::string one_line(std::string_view text);

class Console {
  public:
    explicit Console(bool quiet) : quiet_(quiet) {}

    template <class... Args>
    void note(fmt::format_string<Args...> format, Args&&... args) const {
        line(fmt::format(format, std::forward<Args>(args)...));
    }
    template <class... Args>
    void warn(fmt::format_string<Args...> format, Args&&... args) const {
        line("warning: " + fmt::format(format, std::forward<Args>(args)...));
    }

  private:
    void line(std::string_view text) const;
    bool quiet_;
};

}  // namespace halflight
