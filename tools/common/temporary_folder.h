// A folder of the system's place for temporary files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace halflight {

/// A new, empty folder that only this user can read. It is removed with all that is in it when the object is destroyed.
class TemporaryFolder {
  public:
    TemporaryFolder();  ///< Throws Error where none can be made.
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    ~TemporaryFolder();

    std::filesystem::path path;
    std::filesystem::path operator/(const std::filesystem::path& name) const { return path / name; }
    std::vector<std::string> entries() const;  ///< Returns the names in it, sorted.
};

}  // namespace halflight
