#include "tools/halflight/frame_names.h"

#include <fmt/format.h>

#include <cassert>
#include <regex>

namespace halflight {
namespace {

const std::regex& placeholder() {
    static const std::regex pattern("#+|%(0([1-9][0-9]?))?d");
    return pattern;
}

}  // namespace

int count_placeholders(const std::filesystem::path& pattern) {
    const std::string name = pattern.filename().string();
    return static_cast<int>(std::distance(std::sregex_iterator(name.begin(), name.end(), placeholder()), {}));
}

std::filesystem::path frame_path(const std::filesystem::path& pattern, std::uint32_t frame) {
    const std::string name = pattern.filename().string();
    std::smatch match;
    const bool found = std::regex_search(name, match, placeholder());
    assert(found);
    static_cast<void>(found);
    const bool hashes = match[0].str().front() == '#';
    const int width = hashes ? static_cast<int>(match.length(0)) : match[2].matched ? std::stoi(match[2]) : 1;
    return pattern.parent_path() / fmt::format("{}{:0{}}{}", match.prefix().str(), frame, width, match.suffix().str());
}

}  // namespace halflight
