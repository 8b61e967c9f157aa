// The index of a page file as bytes, and the checks of what it says. No OpenGL is used.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/paging/pages.h"

namespace halflight::paging {

/// Bytes before the first block or page.
inline constexpr std::size_t kPageHeaderBytes = 64;

/// Everything that the index holds. Offsets count from the start of the file.
struct StoredIndex {
    PageIndex index;
    std::vector<std::uint64_t> block_offsets, block_bytes;  // per block of table rows
    std::vector<std::uint64_t> page_offsets, page_bytes;    // per page
};

std::string bytes_of(const StoredIndex& stored);

/// Returns the index of decompressed bytes; none if its numbers contradict each other, or would break limits of the
/// hierarchy over the roots and of kernels. Blocks and pages end before `end`, in bytes from the start of the file.
std::optional<StoredIndex> parse_index(std::string_view bytes, std::uint64_t end);

}  // namespace halflight::paging
