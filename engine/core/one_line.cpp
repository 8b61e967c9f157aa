#include "engine/core/one_line.h"

#include <algorithm>

namespace halflight {
namespace {

/// Returns whether a character of UTF-8 goes on at this byte.
bool continues(char byte) {
    return (static_cast<unsigned char>(byte) & 0xc0) == 0x80;
}

/// Returns the length in bytes of the character at the front of a text, 0 if it is not UTF-8 (Unicode 15, table 3-7).
std::size_t character_length(std::string_view text) {
    const auto first = static_cast<unsigned char>(text[0]);
    const std::size_t length = first < 0x80   ? 1
                               : first < 0xc2 ? 0
                               : first < 0xe0 ? 2
                               : first < 0xf0 ? 3
                               : first < 0xf5 ? 4
                                              : 0;
    if (length < 2) return length;
    if (text.size() < length || !std::ranges::all_of(text.substr(1, length - 1), continues)) return 0;
    const auto second = static_cast<unsigned char>(text[1]);
    const bool too_long = (first == 0xe0 && second < 0xa0) || (first == 0xf0 && second < 0x90),
               no_character = (first == 0xed && second >= 0xa0) || (first == 0xf4 && second >= 0x90);
    return too_long || no_character ? 0 : length;
}

}  // namespace

std::string one_line(std::string_view text) {
    std::string line;
    while (!text.empty()) {
        const std::size_t length = character_length(text);
        const std::string_view character = text.substr(0, std::max<std::size_t>(length, 1));
        const auto byte = static_cast<unsigned char>(character[0]);
        const bool c1 = byte == 0xc2 && static_cast<unsigned char>(character.back()) < 0xa0;
        if (byte == '\n' || byte == '\r' || byte == '\t')
            line += ' ';
        else if (length == 0 || byte < ' ' || byte == 0x7f || c1)
            line += '?';
        else
            line += character;
        text.remove_prefix(character.size());
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
