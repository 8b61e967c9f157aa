// Owns a file in memory that has a name in the file system, for loaders that take names.
#pragma once

#include <filesystem>
#include <string_view>

#include "engine/core/error.h"

namespace halflight::fuzz {

class MemoryFile {
  public:
    explicit MemoryFile(std::string_view bytes);
    MemoryFile(const MemoryFile&) = delete;
    MemoryFile& operator=(const MemoryFile&) = delete;
    ~MemoryFile();

    const std::filesystem::path& path() const { return path_; }

  private:
    int descriptor_;
    std::filesystem::path path_;
};

/// Throws Broken unless the message is one line that starts with `subject`.
void check_message(const Error& error, std::string_view subject);

/// Calls f(). Its errors must be one line that starts with `subject`.
template <class F>
void check_errors(std::string_view subject, F f) {
    try {
        f();
    } catch (const Error& error) {
        check_message(error, subject);
    }
}

}  // namespace halflight::fuzz
