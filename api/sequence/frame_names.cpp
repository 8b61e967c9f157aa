#include "api/halflight/frame_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <optional>
#include <string>
#include <string_view>

namespace halflight {
namespace {

struct Placeholder {
    std::size_t at = 0;
    std::size_t length = 0;
    int width = 1;       // minimum number of digits
    bool signs = false;  // a minus sign counts as one of them
};

/// Finds %d or %0Nd, N from 1 to 99, at the start of `text`.
std::optional<Placeholder> printf_placeholder(std::string_view text) {
    const auto digit = [&](std::size_t i) { return i < text.size() && text[i] >= '0' && text[i] <= '9'; };
    Placeholder found{0, 1, 1, true};
    if (digit(1) && text[1] == '0' && digit(2) && text[2] != '0') {
        found.width = text[2] - '0';
        found.length = 3;
        if (digit(3)) found.width = 10 * found.width + (text[3] - '0'), found.length = 4;
    }
    if (!text.substr(found.length).starts_with('d')) return std::nullopt;
    ++found.length;
    return found;
}

/// Finds the first placeholder from `from` on.
std::optional<Placeholder> find_placeholder(std::string_view name, std::size_t from = 0) {
    for (std::size_t i = from; i < name.size(); ++i) {
        if (name[i] == '#') {
            const std::size_t end = std::min(name.find_first_not_of('#', i), name.size());
            return Placeholder{i, end - i, static_cast<int>(end - i)};
        }
        if (name[i] != '%') continue;
        if (auto found = printf_placeholder(name.substr(i))) {
            found->at = i;
            return found;
        }
    }
    return std::nullopt;
}

}  // namespace

int count_placeholders(const std::filesystem::path& pattern) {
    const std::string name = pattern.filename().string();
    int count = 0;
    for (auto found = find_placeholder(name); found; found = find_placeholder(name, found->at + found->length)) ++count;
    return count;
}

std::filesystem::path frame_path(const std::filesystem::path& pattern, FrameNumber frame) {
    const std::string name = pattern.filename().string();
    const auto found = find_placeholder(name);
    assert(found);
    const int width = found->width + (frame < 0 && !found->signs ? 1 : 0);
    return pattern.parent_path() /
           fmt::format("{}{:0{}}{}", name.substr(0, found->at), frame, width, name.substr(found->at + found->length));
}

}  // namespace halflight
