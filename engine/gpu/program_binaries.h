// Linked programs on disk, which save compilation in later runs.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace halflight::gpu {

struct ProgramBinary {
    std::uint32_t format = 0;  // driver-specific format of glProgramBinary()
    std::vector<char> bytes;
};

/// A folder with one file per program, which several processes may share. Failures only cost time: unreadable files
/// count as missing, and failed writes are ignored.
class ProgramBinaries {
  public:
    static constexpr std::uint64_t kMaxBytes = std::uint64_t{64} << 20;  // bytes; about a thousand programs

    /// Opens a folder. `driver` identifies the compiler and is part of every key.
    ProgramBinaries(std::filesystem::path folder, std::string driver, std::uint64_t max_bytes = kMaxBytes);

    /// Returns the program stored under the key; nothing if the file is missing, damaged, or belongs to another key.
    std::optional<ProgramBinary> load(std::string_view key) const;
    /// Returns how often load() found nothing, on any thread. Such programs are compiled.
    std::size_t misses() const { return misses_; }
    /// Returns whether there is a file for the key.
    bool has(std::string_view key) const;
    /// Writes a file that gets its name once it is complete. Removes the least recently used files if all exceed
    /// max_bytes.
    void store(std::string_view key, const ProgramBinary& binary) const;
    /// Returns the path of the key's file.
    std::filesystem::path file(std::string_view key) const;

  private:
    std::optional<ProgramBinary> read(std::string_view key) const;

    std::filesystem::path folder_;
    std::string driver_;  // ends with a newline
    std::uint64_t max_bytes_;
    mutable std::atomic<std::size_t> misses_ = 0;
};

/// Returns $XDG_CACHE_HOME/halflight/programs, else ~/.cache/halflight/programs (XDG Base Directory Specification 0.8);
/// empty if neither has an absolute path.
std::filesystem::path default_binaries_folder();

}  // namespace halflight::gpu
