// Notes and warnings on stderr, one line each. main() shows errors.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <string_view>

namespace halflight {

/// Returns `text` with control characters replaced, so that it is one line whatever names it quotes.
std::string one_line(std::string_view text);

/// Writes to `stream` unchanged. Failures are ignored: a closed or full stderr must not lose a picture.
void put(std::FILE* stream, std::string_view text);

/// Opens /dev/null, read-only, for closed standard streams. Otherwise the first opened file would get the stream's
/// number, and with it the stream's output. Writing to such a stream still fails.
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
