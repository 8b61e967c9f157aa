#include "engine/paging/page_file_index.h"

#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <tuple>
#include <type_traits>

#include "engine/io/zstd_frame.h"
#include "engine/paging/byte_reader.h"
#include "engine/paging/page_codec.h"
#include "shaders/shared/bvh_nodes.h"

namespace halflight::paging {
namespace {

constexpr std::uint32_t kMostOfPage = 1u << 20;
constexpr std::uint32_t kMostAlphaTested = 1u << 16;
/// Most nodes on a path above subtrees, and stack entries of a subtree. Embree's hierarchies have 64 levels at most, of
/// nodes with four children.
constexpr std::uint32_t kMostDepth = 128;
constexpr std::uint32_t kMostStackEntries = 256;

/// MeshRange without padding.
using RangeWords = std::array<std::uint32_t, 8>;
constexpr std::uint32_t kMerged = 1, kMoves = 2;
constexpr std::uint32_t kSlivers = 1, kAlpha = 2, kColors = 4, kTangents = 8, kOneSided = 16, kPanes = 32,
                        kStraightGlass = 64;

static_assert(sizeof(PageRoot) == 32 && sizeof(PageIndex::Size) == 16 && sizeof(FileContent) == 24);

template <class T>
void append_list(const std::vector<T>& values, std::string& bytes) {
    const std::uint64_t count = values.size();
    append_bytes(&count, 1, bytes);
    append_bytes(values.data(), values.size(), bytes);
}

StoredIndex read_index(ByteReader& reader) {
    StoredIndex stored;
    PageIndex& index = stored.index;
    const auto read = [&](auto& value) { value = reader.value<std::remove_reference_t<decltype(value)>>(); };
    read(index.limits.bytes), read(index.limits.alpha_tested);
    read(index.alpha_tests), read(index.origin), read(index.bounds);
    read(index.triangles), read(index.vertices), read(index.vertex_texels), read(index.stack_entries);
    const auto flags = reader.value<std::uint32_t>();
    index.slivers = (flags & kSlivers) != 0, index.alpha = (flags & kAlpha) != 0;
    index.one_sided = (flags & kOneSided) != 0, index.panes = (flags & kPanes) != 0;
    index.straight_glass = (flags & kStraightGlass) != 0;
    const auto used = reader.list<std::uint8_t>();
    index.geometry.used_materials.assign(used.begin(), used.end());
    index.geometry.vertex_colors = (flags & kColors) != 0, index.geometry.tangents = (flags & kTangents) != 0;
    index.geometry.resident = reader.list<std::uint32_t>();
    index.pages = reader.list<PageIndex::Size>();
    index.roots = reader.list<PageRoot>();
    index.above = reader.list<std::uint32_t>();
    for (const RangeWords& w : reader.list<RangeWords>()) {
        MeshRange& r = index.ranges.emplace_back();
        std::tie(r.mesh, r.instance, r.block) = std::tie(w[0], w[1], w[3]);
        r.merged = (w[2] & kMerged) != 0, r.moves = (w[2] & kMoves) != 0;
        std::tie(r.first_vertex, r.vertex_count, r.first_triangle, r.triangle_count) = std::tie(w[4], w[5], w[6], w[7]);
    }
    index.empty = reader.list<std::uint32_t>();
    index.files = reader.list<FileContent>();
    for (auto* list : {&stored.block_offsets, &stored.block_bytes, &stored.page_offsets, &stored.page_bytes})
        *list = reader.list<std::uint64_t>();
    return stored;
}

/// Returns whether parts lie between the header and the end. most(i): the largest part i before compression, bytes.
template <class Most>
bool within(const std::vector<std::uint64_t>& offsets, const std::vector<std::uint64_t>& bytes, std::uint64_t end,
            Most most) {
    if (offsets.size() != bytes.size()) return false;
    for (std::size_t i = 0; i < offsets.size(); ++i)
        if (offsets[i] < kPageHeaderBytes || offsets[i] > end || bytes[i] > end - offsets[i] ||
            bytes[i] > most_compressed(most(i)))
            return false;
    return true;
}

/// Returns whether the index has as many blocks and pages as the scene needs, with offsets and sizes within the file.
bool parts_fit(const StoredIndex& stored, std::uint64_t end) {
    const PageIndex& index = stored.index;
    const std::uint64_t blocks = (std::uint64_t{index.triangles} + kTrianglesPerBlock - 1) / kTrianglesPerBlock;
    const std::uint32_t page_bytes = index.limits.bytes;
    if (page_bytes < kLeastPageBytes || page_bytes > kMostPageBytes || page_bytes % kPageByteSteps != 0 ||
        index.limits.alpha_tested >= kMostAlphaTested ||
        index.vertex_texels != static_cast<std::uint32_t>(vertex_layout(index).vertex_stride()) ||
        index.vertex_texels > kMostVertexTexels || stored.block_offsets.size() != blocks ||
        stored.page_offsets.size() != index.pages.size() ||
        index.pages.size() > std::numeric_limits<std::uint32_t>::max())
        return false;
    for (const PageIndex::Size& size : index.pages)
        if (size.roots == 0 || size.roots > size.nodes || size.nodes > kMostOfPage || size.pairs > kMostOfPage ||
            size.vertices > kMostOfPage || bytes_in_slot(size) > page_bytes)
            return false;
    return within(stored.block_offsets, stored.block_bytes, end, [](std::size_t) { return kMostBlockBytes; }) &&
           within(stored.page_offsets, stored.page_bytes, end,
                  [&](std::size_t page) { return decoded_bytes(index.pages[page]); });
}

bool resident_ascend(const PageIndex& index) {
    const std::vector<std::uint32_t>& resident = index.geometry.resident;
    return std::ranges::adjacent_find(resident, std::greater_equal()) == resident.end() &&
           (resident.empty() || resident.back() < index.triangles);
}

/// Returns whether bounds are finite, and have an extent of 0 or more along each axis.
bool sound(const Bounds& bounds) {
    return within_reach(bounds.lower) && within_reach(bounds.upper) &&
           glm::all(glm::lessThanEqual(bounds.lower, bounds.upper));
}

bool same(const Bounds& a, const Bounds& b) {
    return a.lower == b.lower && a.upper == b.upper;
}

/// Returns whether hierarchy_over() and kernels can work with the roots and the nodes above them. These are a forest of
/// limited depth, whose nodes have two to four children. Embree accepts the boxes of the roots.
bool hierarchy_fits(const PageIndex& index) {
    constexpr double kInfinite = std::numeric_limits<double>::infinity();
    const bool nothing = index.roots.empty() && same(index.bounds, Bounds());
    if (!glm::all(glm::lessThan(glm::abs(index.origin), dvec3(kInfinite))) || (!nothing && !sound(index.bounds)) ||
        index.stack_entries > kMostStackEntries || (index.stack_entries < 1 && !index.roots.empty()))
        return false;
    std::size_t root = 0;
    for (std::uint32_t page = 0; page < index.pages.size(); ++page)
        for (std::uint32_t i = 0; i < index.pages[page].roots; ++i, ++root)
            if (root >= index.roots.size() || index.roots[root].page != page || !sound(index.roots[root].bounds))
                return false;
    if (root != index.roots.size()) return false;
    std::vector<std::uint8_t> children(index.above.size(), 0), depth(index.above.size(), 1);
    const auto add_child = [&](std::uint32_t parent, std::size_t end) {
        return parent == PageRoot::kNoParent || (parent < end && ++children[parent] <= 4);
    };
    for (const PageRoot& r : index.roots)
        if (!add_child(r.parent, children.size())) return false;
    for (std::size_t i = 0; i < index.above.size(); ++i) {
        const std::uint32_t parent = index.above[i];
        if (!add_child(parent, i)) return false;
        if (parent == PageRoot::kNoParent) continue;
        if (depth[parent] == kMostDepth) return false;
        depth[i] = static_cast<std::uint8_t>(depth[parent] + 1);
    }
    return std::ranges::all_of(children, [](std::uint8_t count) { return count >= 2; });
}

/// Returns whether the ranges of meshes have all triangles and vertices, in ascending order.
bool ranges_fit(const PageIndex& index) {
    std::uint64_t triangles = 0, vertices = 0;
    for (const MeshRange& range : index.ranges) {
        if (!range.merged || range.moves || range.block != 0 || range.first_triangle != triangles ||
            range.first_vertex != vertices)
            return false;
        triangles += range.triangle_count;
        vertices += range.vertex_count;
    }
    return triangles == index.triangles && vertices == index.vertices && triangles <= shared::kBvhTriangleLimit;
}

}  // namespace

std::string bytes_of(const StoredIndex& stored) {
    const PageIndex& index = stored.index;
    std::string bytes;
    bytes.reserve(sizeof(PageIndex));  // GCC 12 sees an overflow in a string that grows here
    const auto add = [&](const auto& value) { append_bytes(&value, 1, bytes); };
    add(index.limits.bytes), add(index.limits.alpha_tested);
    add(index.alpha_tests), add(index.origin), add(index.bounds);
    add(index.triangles), add(index.vertices), add(index.vertex_texels), add(index.stack_entries);
    add((index.slivers ? kSlivers : 0) | (index.alpha ? kAlpha : 0) | (index.geometry.vertex_colors ? kColors : 0) |
        (index.geometry.tangents ? kTangents : 0) | (index.one_sided ? kOneSided : 0) | (index.panes ? kPanes : 0) |
        (index.straight_glass ? kStraightGlass : 0));
    append_list(std::vector<std::uint8_t>(index.geometry.used_materials.begin(), index.geometry.used_materials.end()),
                bytes);
    append_list(index.geometry.resident, bytes);
    append_list(index.pages, bytes);
    append_list(index.roots, bytes);
    append_list(index.above, bytes);
    std::vector<RangeWords> ranges;
    for (const MeshRange& r : index.ranges)
        ranges.push_back({r.mesh, r.instance, (r.merged ? kMerged : 0) | (r.moves ? kMoves : 0), r.block,
                          r.first_vertex, r.vertex_count, r.first_triangle, r.triangle_count});
    append_list(ranges, bytes);
    append_list(index.empty, bytes);
    append_list(index.files, bytes);
    for (const auto* list : {&stored.block_offsets, &stored.block_bytes, &stored.page_offsets, &stored.page_bytes})
        append_list(*list, bytes);
    return bytes;
}

std::optional<StoredIndex> parse_index(std::string_view bytes, std::uint64_t end) {
    ByteReader reader(bytes);
    StoredIndex stored = read_index(reader);
    if (!reader.at_end() || !parts_fit(stored, end) || !resident_ascend(stored.index) ||
        !hierarchy_fits(stored.index) || !ranges_fit(stored.index))
        return {};
    return stored;
}

}  // namespace halflight::paging
