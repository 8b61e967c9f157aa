#include "engine/core/error.h"

#include "engine/core/one_line.h"

namespace halflight {

Error::Error(std::string_view subject, std::string_view what)
    : std::runtime_error(one_line(subject.empty() ? std::string(what) : fmt::format("{}: {}", subject, what))),
      reason_(0) {
    const std::string begin = one_line(fmt::format("{}:", subject)) + ' ';
    if (!subject.empty() && std::string_view(this->what()).starts_with(begin)) reason_ = begin.size();
}

std::string_view Error::reason() const {
    return std::string_view(what()).substr(reason_);
}

}  // namespace halflight
