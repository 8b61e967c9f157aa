#include "engine/core/error.h"

#include "engine/core/one_line.h"

namespace halflight {

Error::Error(std::string_view subject, std::string_view what)
    : std::runtime_error(one_line(subject.empty() ? std::string(what) : fmt::format("{}: {}", subject, what))) {}

}  // namespace halflight
