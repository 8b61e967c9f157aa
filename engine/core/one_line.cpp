#include "engine/core/one_line.h"

namespace halflight {
namespace {

/// Returns whether a character of UTF-8 goes on at this byte.
bool continues(char byte) {
    return (static_cast<unsigned char>(byte) & 0xc0) == 0x80;
}

}  // namespace

std::string one_line(std::string_view text) {
    std::string line;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const auto byte = static_cast<unsigned char>(text[i]);
        const auto next = static_cast<unsigned char>(i + 1 < text.size() ? text[i + 1] : 0);
        if (byte == '\n' || byte == '\r' || byte == '\t') {
            line += ' ';
        } else if (byte == 0xc2 && next >= 0x80 && next < 0xa0) {  // C1
            line += '?';
            ++i;
        } else {
            line += byte < ' ' || byte == 0x7f ? '?' : text[i];
        }
    }
    while (line.ends_with(' ')) line.pop_back();
    if (line.size() <= kMostMessage) return line;
    constexpr std::string_view kGap = " [...] ";
    std::size_t first = kMostMessage / 2, last = line.size() - (kMostMessage / 2 - kGap.size());
    while (first > 0 && continues(line[first])) --first;
    while (last < line.size() && continues(line[last])) ++last;
    return line.substr(0, first).append(kGap).append(line, last);
}

}  // namespace halflight
