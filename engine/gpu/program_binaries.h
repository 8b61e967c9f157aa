// Linked programs on disk, so that a later start of the program need not compile them again.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace halflight::gpu {

struct ProgramBinary {
    std::uint32_t format = 0;  // the driver's own
    std::vector<char> bytes;
};

/// A folder with one file per program. Whatever is wrong with it costs time and nothing else: what cannot be read is
/// not there, what cannot be written is not kept. Several processes may share it.
class ProgramBinaries {
  public:
    static constexpr std::uint64_t kMaxBytes = std::uint64_t{64} << 20;  // some thousand programs

    /// driver: all that tells one compiler from another; part of every key.
    ProgramBinaries(std::filesystem::path folder, std::string driver, std::uint64_t max_bytes = kMaxBytes);

    /// What was stored under the key; nothing where the file is missing, damaged, or another key's.
    std::optional<ProgramBinary> load(std::string_view key) const;
    /// Under a temporary name, then renamed. Files that were used longest ago go where all are more than max_bytes.
    void store(std::string_view key, const ProgramBinary& binary) const;
    /// Where the key's file is.
    std::filesystem::path file(std::string_view key) const;

  private:
    std::string full_key(std::string_view key) const;
    void make_room() const;

    std::filesystem::path folder_;
    std::string driver_;
    std::uint64_t max_bytes_;
};

/// $XDG_CACHE_HOME/halflight/programs, else ~/.cache/halflight/programs (XDG Base Directory Specification 0.8); empty
/// where neither has an absolute path.
std::filesystem::path default_binaries_folder();

}  // namespace halflight::gpu
