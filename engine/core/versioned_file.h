// Files together with what tells whether they have changed.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>

namespace halflight {

/// A file, and numbers that differ after it has been written to or replaced by another one.
struct VersionedFile {
    std::filesystem::path path;
    std::array<std::uint64_t, 5> version{};  // first the device and the inode, which writing does not change
};

}  // namespace halflight
