#include "tools/cli/console.h"

#include <fcntl.h>
#include <unistd.h>

namespace halflight {

void put(std::FILE* stream, std::string_view text) {
    std::fwrite(text.data(), 1, text.size(), stream);
}

int fail(int status, std::string_view what) {
    put(stderr, fmt::format("halflight: {}\n", one_line(what)));
    return status;
}

void hold_standard_streams() {
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})  // open() returns the lowest free number
        if (fcntl(stream, F_GETFD) == -1) open("/dev/null", O_RDONLY);
}

Console::Console(bool quiet)
    : Log(quiet ? Sink() : [](Kind kind, std::string_view line) {
          put(stderr, fmt::format("halflight: {}{}\n", kind == Kind::warning ? "warning: " : "", one_line(line)));
      }) {}

}  // namespace halflight
