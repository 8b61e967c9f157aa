// Folders below the system's folder for temporary files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace halflight {

/// A new, empty folder that only this user can read. The destructor removes it with all its contents.
class TemporaryFolder {
  public:
    TemporaryFolder();  ///< Makes the folder, below /tmp if TMPDIR names no folder. Throws Error on failure.
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    ~TemporaryFolder();

    std::filesystem::path path;
    std::filesystem::path operator/(const std::filesystem::path& name) const { return path / name; }
    std::vector<std::string> entries() const;  ///< Returns the names of its entries, sorted.
};

}  // namespace halflight
