// What the program says on stderr: notes and warnings, one line each. Errors are shown by main().
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <string_view>

namespace halflight {

/// `text` with control characters replaced, so that it stays one line whatever names it quotes.
std::string one_line(std::string_view text);

/// To `stream` as it is. That stderr is closed or full is no reason to lose a picture: a failure is ignored.
void put(std::FILE* stream, std::string_view text);

/// Standard streams that are closed are held by /dev/null, read-only: the first file that is opened must not get their
/// number, and with it what is meant for them. Writing to them still fails.
void hold_standard_streams();

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
