// Zstandard frames with checksums.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace halflight {

/// Returns a frame of `bytes` with a checksum. Thread-safe.
std::string compress(std::string_view bytes, int level);

/// Returns the most bytes that a frame of so many bytes can have.
std::size_t most_compressed(std::size_t bytes);

/// Decompresses a frame of at most `most` bytes. Returns false if it is damaged. Thread-safe.
bool decompress(std::string_view frame, std::size_t most, std::string& bytes);

}  // namespace halflight
