#include "engine/core/error.h"

#include <algorithm>

#include "engine/core/one_line.h"

namespace halflight {

Error::Error(std::string_view subject, std::string_view what)
    : std::runtime_error(one_line(subject.empty() ? std::string(what) : fmt::format("{}: {}", subject, what))),
      reason_(subject.empty() ? 0 : one_line(subject).size() + 2) {}

std::string_view Error::reason() const {
    const std::string_view line = what();
    return line.substr(std::min(reason_, line.size()));  // the middle of long lines is left out
}

}  // namespace halflight
