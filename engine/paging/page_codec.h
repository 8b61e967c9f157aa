// Pages and table rows as page files store them: encoded into bytes, in Zstandard frames. No OpenGL is used.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/paging/pages.h"

namespace halflight::paging {

/// Triangles per block of table rows. The rows of a triangle are one read of about 64 KiB before compression.
inline constexpr std::uint32_t kTrianglesPerBlock = 512;
inline constexpr std::uint32_t kMostVertexTexels = 4;  // SceneNeeds::vertex_stride()
/// Most bytes of a block that is not compressed.
inline constexpr std::size_t kMostBlockBytes =
    16 + kTrianglesPerBlock * (4 * sizeof(std::uint32_t) +
                               3 * (sizeof(std::uint32_t) + sizeof(vec3) + kMostVertexTexels * sizeof(vec4)));

/// Table rows of consecutive triangles, and of the vertices that they use. A vertex is in all blocks that use it.
struct TableBlock {
    std::vector<uvec4> triangles;                       // TraceTables::triangles
    std::vector<std::array<std::uint16_t, 3>> corners;  // per triangle, places in the arrays below
    std::vector<vec3> positions;                        // TraceTables::positions
    std::vector<vec4> attributes;                       // ShadingTables::vertices
    std::size_t bytes() const;                          ///< Returns the bytes of the arrays.
};

/// Level of Zstandard's compression.
inline constexpr int kCompressionLevel = 3;

/// Returns the compressed bytes of a block or page, as a page file stores them. Thread-safe.
std::string encode(const TableBlock& block);
std::string encode(const Page& page);

/// Returns the number of bytes that a page has before compression.
std::size_t decoded_bytes(const PageIndex::Size& size);
/// Decodes a page from decompressed bytes. Returns none if `size` does not fit them. Values of nodes and pairs are not
/// checked.
std::optional<Page> decode_page(std::string_view bytes, const PageIndex::Size& size);
/// Decodes a block from decompressed bytes. Returns none if its numbers contradict each other or the index.
std::optional<TableBlock> decode_block(std::string_view bytes, const PageIndex& index);

}  // namespace halflight::paging
