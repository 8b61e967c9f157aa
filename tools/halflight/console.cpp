#include "tools/halflight/console.h"

#include <algorithm>
#include <cstdio>

namespace halflight {

std::string one_line(std::string_view text) {
    std::string line(text);
    std::ranges::replace_if(
        line, [](unsigned char c) { return c < ' ' || c == 0x7f; }, '?');
    return line;
}

void Console::line(std::string_view text) const {
    if (!quiet_) fmt::print(stderr, "halflight: {}\n", one_line(text));
}

}  // namespace halflight
