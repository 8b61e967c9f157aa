#include "engine/core/error.h"

#include <algorithm>

namespace halflight {
namespace {

/// Messages of libraries may span lines; ours never do.
std::string one_line(std::string_view subject, std::string_view what) {
    std::string line(subject);
    if (!line.empty()) line += ": ";
    line += what;
    while (!line.empty() && (line.back() == '\n' || line.back() == ' ')) line.pop_back();
    std::replace_if(
        line.begin(), line.end(), [](char c) { return c == '\n' || c == '\r' || c == '\t'; }, ' ');
    return line;
}

}  // namespace

Error::Error(std::string_view subject, std::string_view what) : std::runtime_error(one_line(subject, what)) {}

}  // namespace halflight
