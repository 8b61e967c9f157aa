// Error policy: assert() for mistakes in our own logic, Error for failures of files, drivers and arguments, and return
// values for expected outcomes. The library neither prints nor exits; a program shows Error::what() as one line.
#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>

namespace halflight {

/// An error message of one line, "subject: what is wrong". The subject names file and element ("room.glb:
/// accessors[3]").
class Error : public std::runtime_error {
  public:
    Error(std::string_view subject, std::string_view what);

    template <class... Args>
    Error(std::string_view subject, fmt::format_string<Args...> format, Args&&... args) requires(sizeof...(Args) > 0)
        : Error(subject, std::string_view(fmt::format(format, std::forward<Args>(args)...))) {}

    /// Returns the message without its subject; the whole message if that has been shortened within the subject.
    std::string_view reason() const;

  private:
    std::size_t reason_;  // where it begins in what()
};

}  // namespace halflight
