#include "engine/paging/page_codec.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "engine/io/zstd_frame.h"
#include "engine/paging/byte_reader.h"
#include "engine/rays/page_node.h"
#include "engine/tables/tables.h"
#include "shaders/shared/bvh_nodes.h"

namespace halflight::paging {
namespace {

/// Appends the bytes of records of `fields` words each, sorted by their place in the record: all lowest bytes of the
/// first field, of the second, and so on. Bytes of one place resemble each other, which halves what Zstandard leaves.
void shuffle(const std::uint32_t* words, std::size_t fields, std::size_t records, std::string& bytes) {
    const std::size_t first = bytes.size(), plane = fields * records;
    bytes.resize(first + 4 * plane);
    for (std::size_t field = 0; field < fields; ++field) {
        char* to = bytes.data() + first + field * records;
        for (std::size_t i = 0; i < records; ++i, ++to) {
            const std::uint32_t word = words[i * fields + field];
            to[0] = static_cast<char>(word), to[plane] = static_cast<char>(word >> 8);
            to[2 * plane] = static_cast<char>(word >> 16), to[3 * plane] = static_cast<char>(word >> 24);
        }
    }
}

/// Reverses shuffle().
void unshuffle(const char* bytes, std::size_t fields, std::size_t records, std::uint32_t* words) {
    const std::size_t plane = fields * records;
    const auto byte = [](char c) { return std::uint32_t{static_cast<unsigned char>(c)}; };
    for (std::size_t field = 0; field < fields; ++field) {
        const char* from = bytes + field * records;
        for (std::size_t i = 0; i < records; ++i, ++from)
            words[i * fields + field] =
                byte(from[0]) | byte(from[plane]) << 8 | byte(from[2 * plane]) << 16 | byte(from[3 * plane]) << 24;
    }
}

template <class T>
const std::uint32_t* words_of(const std::vector<T>& values) {
    return reinterpret_cast<const std::uint32_t*>(values.data());
}

/// Reads shuffled records of `each` values of T.
template <class T>
std::vector<T> shuffled(ByteReader& reader, std::size_t records, std::size_t each = 1) {
    std::vector<T> values;
    const std::string_view from = reader.take(records * each * sizeof(T));
    if (!reader.ok()) return values;
    values.resize(records * each);
    unshuffle(from.data(), each * sizeof(T) / 4, records, reinterpret_cast<std::uint32_t*>(values.data()));
    return values;
}

/// Words of a pair as it is stored: id of the first triangle, difference of the ids, orders and flags, corners. A
/// corner is stored as the number of vertices of earlier pairs and corners, minus its index.
constexpr std::size_t kPairWords = 7;
constexpr std::uint32_t kFirstAlpha = 0x100, kSecondAlpha = 0x200, kFirstFacing = 0x400, kSecondFacing = 0x800;

std::vector<std::uint32_t> stored_pairs(const std::vector<uvec4>& pairs) {
    std::vector<std::uint32_t> words;
    words.reserve(kPairWords * pairs.size());
    std::uint32_t vertices = 0;
    for (const uvec4& pair : pairs) {
        const std::uint32_t first = pair.x & shared::kBvhTriangleMask, second = pair.y & shared::kBvhTriangleMask;
        const std::uint32_t flags = ((pair.x & shared::kBvhPageAlpha) != 0 ? kFirstAlpha : 0) |
                                    ((pair.y & shared::kBvhPageAlpha) != 0 ? kSecondAlpha : 0) |
                                    ((pair.x & shared::kBvhPageFacing) != 0 ? kFirstFacing : 0) |
                                    ((pair.y & shared::kBvhPageFacing) != 0 ? kSecondFacing : 0);
        words.insert(words.end(), {first, second - first,
                                   flags | (pair.z >> shared::kBvhPageOrderShift) |
                                       ((pair.w >> shared::kBvhPageOrderShift) << shared::kBvhOrderShift)});
        for (int corner = 0; corner < 4; ++corner) {
            const std::uint32_t index =
                (pair[2 + corner / 2] >> (corner % 2 * shared::kBvhPageCornerBits)) & shared::kBvhPageCornerMask;
            words.push_back(vertices - index);
            vertices = std::max(vertices, index + 1);
        }
    }
    return words;
}

/// Reverses stored_pairs(). Of damaged words it makes any pairs.
std::vector<uvec4> pairs_of(const std::vector<std::uint32_t>& words) {
    std::vector<uvec4> pairs;
    pairs.reserve(words.size() / kPairWords);
    std::uint32_t vertices = 0;
    for (std::size_t i = 0; i < words.size(); i += kPairWords) {
        const std::uint32_t orders = words[i + 2];
        uvec4 pair(words[i], words[i] + words[i + 1], orders << shared::kBvhPageOrderShift,
                   orders >> shared::kBvhOrderShift << shared::kBvhPageOrderShift);
        if ((orders & kFirstAlpha) != 0) pair.x |= shared::kBvhPageAlpha;
        if ((orders & kSecondAlpha) != 0) pair.y |= shared::kBvhPageAlpha;
        if ((orders & kFirstFacing) != 0) pair.x |= shared::kBvhPageFacing;
        if ((orders & kSecondFacing) != 0) pair.y |= shared::kBvhPageFacing;
        for (std::uint32_t corner = 0; corner < 4; ++corner) {
            const std::uint32_t index = (vertices - words[i + 3 + corner]) & shared::kBvhPageCornerMask;
            pair[static_cast<int>(2 + corner / 2)] |= index << (corner % 2 * shared::kBvhPageCornerBits);
            vertices = std::max(vertices, index + 1);
        }
        pairs.push_back(pair);
    }
    return pairs;
}

/// Corners of a block as differences of successive places, which repeat if triangles form strips or quads.
std::vector<std::uint32_t> differences(const std::vector<std::array<std::uint16_t, 3>>& corners) {
    std::vector<std::uint32_t> steps;
    steps.reserve(3 * corners.size());
    std::uint32_t last = 0;
    for (const auto& triangle : corners)
        for (const std::uint32_t corner : triangle) steps.push_back(corner - std::exchange(last, corner));
    return steps;
}

}  // namespace

std::size_t TableBlock::bytes() const {
    return sizeof(TableBlock) + triangles.size() * sizeof(uvec4) + corners.size() * sizeof(corners[0]) +
           positions.size() * sizeof(vec3) + attributes.size() * sizeof(vec4);
}

std::string encode(const TableBlock& block) {
    const std::size_t vertices = block.positions.size();
    std::vector<std::uint32_t> words, indices(vertices, 0);
    for (std::size_t i = 0; i < block.triangles.size(); ++i) {
        words.push_back(block.triangles[i].w);
        for (std::size_t k = 0; k < 3; ++k) indices[block.corners[i][k]] = block.triangles[i][static_cast<int>(k)];
    }
    std::adjacent_difference(indices.begin(), indices.end(), indices.begin());
    const std::array<std::uint32_t, 2> counts = {static_cast<std::uint32_t>(block.triangles.size()),
                                                 static_cast<std::uint32_t>(vertices)};
    std::string bytes;
    append_bytes(counts.data(), counts.size(), bytes);
    shuffle(differences(block.corners).data(), 1, 3 * block.corners.size(), bytes);
    shuffle(words.data(), 1, words.size(), bytes);
    shuffle(indices.data(), 1, indices.size(), bytes);
    shuffle(words_of(block.positions), 3, vertices, bytes);
    if (vertices > 0) shuffle(words_of(block.attributes), 4 * block.attributes.size() / vertices, vertices, bytes);
    return compress(bytes, kCompressionLevel);
}

std::string encode(const Page& page) {
    std::string bytes;
    shuffle(words_of(page.nodes), 4 * shared::kBvhPageTexels, page.nodes.size() / shared::kBvhPageTexels, bytes);
    shuffle(stored_pairs(page.pairs).data(), kPairWords, page.pairs.size(), bytes);
    shuffle(words_of(page.vertices), 3, page.vertices.size(), bytes);
    return compress(bytes, kCompressionLevel);
}

std::size_t decoded_bytes(const PageIndex::Size& size) {
    return std::size_t{size.nodes} * sizeof(rays::PageNode) + std::size_t{size.pairs} * kPairWords * 4 +
           std::size_t{size.vertices} * sizeof(vec3);
}

std::optional<Page> decode_page(std::string_view bytes, const PageIndex::Size& size) {
    if (bytes.size() != decoded_bytes(size)) return {};
    Page page;
    page.roots = size.roots;
    ByteReader reader(bytes);
    page.nodes = shuffled<uvec4>(reader, size.nodes, shared::kBvhPageTexels);
    page.pairs = pairs_of(shuffled<std::uint32_t>(reader, size.pairs, kPairWords));
    page.vertices = shuffled<vec3>(reader, size.vertices);
    return page;
}

std::optional<TableBlock> decode_block(std::string_view bytes, const PageIndex& index) {
    ByteReader reader(bytes);
    const auto triangles = reader.value<std::uint32_t>(), vertices = reader.value<std::uint32_t>();
    if (triangles > kTrianglesPerBlock || vertices > 3 * kTrianglesPerBlock) return {};
    const std::vector<std::uint32_t> steps = shuffled<std::uint32_t>(reader, 3 * std::size_t{triangles});
    const std::vector<std::uint32_t> words = shuffled<std::uint32_t>(reader, triangles);
    std::vector<std::uint32_t> indices = shuffled<std::uint32_t>(reader, vertices);
    TableBlock block;
    block.positions = shuffled<vec3>(reader, vertices);
    block.attributes = shuffled<vec4>(reader, vertices, index.vertex_texels);
    if (!reader.at_end() || !std::ranges::all_of(block.positions, within_reach)) return {};
    std::inclusive_scan(indices.begin(), indices.end(), indices.begin());
    const std::vector<bool>& used = index.geometry.used_materials;
    std::uint32_t corner = 0;
    for (std::size_t i = 0; i < triangles; ++i) {
        const std::uint32_t material = words[i] & kTriangleMaterialMask;
        if (material >= used.size() || !used[material]) return {};
        std::array<std::uint16_t, 3> corners;
        uvec4 row(0, 0, 0, words[i]);
        for (std::size_t k = 0; k < 3; ++k) {
            corner += steps[3 * i + k];
            if (corner >= vertices || indices[corner] >= index.vertices) return {};
            corners[k] = static_cast<std::uint16_t>(corner);
            row[static_cast<int>(k)] = indices[corner];
        }
        block.corners.push_back(corners);
        block.triangles.push_back(row);
    }
    return block;
}

}  // namespace halflight::paging
