#include "engine/paging/page_file.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstring>
#include <functional>
#include <limits>
#include <list>
#include <mutex>
#include <numeric>
#include <type_traits>
#include <unordered_map>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/hash.h"
#include "engine/core/memory_ledger.h"
#include "engine/io/zstd_frame.h"
#include "engine/rays/page_node.h"
#include "shaders/shared/bvh.h"

namespace halflight::paging {
namespace {

static_assert(std::endian::native == std::endian::little);

// Like the magic of PNG files, it also detects transfers that change line ends.
constexpr std::array<char, 8> kMagic = {'\x89', 'H', 'L', 'P', '\r', '\n', '\x1a', '\n'};

struct Header {
    std::array<char, 8> magic = kMagic;
    std::uint32_t version = kPageFileVersion;
    std::uint32_t triangles_per_block = kTrianglesPerBlock;
    std::uint64_t file_bytes = 0;
    std::uint64_t index_offset = 0;     // bytes from the start of the file
    std::uint64_t index_bytes = 0;      // stored bytes
    std::uint64_t index_raw_bytes = 0;  // bytes after decompression
    std::uint64_t reserved = 0;
    std::uint64_t checksum = 0;  // hash of all bytes before this one

    std::uint64_t sum() const { return hash_of({reinterpret_cast<const char*>(this), offsetof(Header, checksum)}); }
};
static_assert(sizeof(Header) == 64 && std::is_trivially_copyable_v<Header>);

constexpr std::uint32_t kMostVertexTexels = 4;  // SceneNeeds::vertex_stride()
constexpr std::uint32_t kMostOfPage = 1u << 20;
constexpr std::uint32_t kMostAlphaTested = 1u << 16;
constexpr std::size_t kMostBlockBytes =
    16 + kTrianglesPerBlock * (4 * sizeof(std::uint32_t) +
                               3 * (sizeof(std::uint32_t) + sizeof(vec3) + kMostVertexTexels * sizeof(vec4)));

// --- Compression -----------------------------------------------------------------------------------------------------

// Level of Zstandard's compression.
constexpr int kLevel = 3;

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

template <class T>
void append_bytes(const T* values, std::size_t count, std::string& bytes) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes.append(reinterpret_cast<const char*>(values), count * sizeof(T));
}

/// Reads values from bytes; a read beyond their end gives zeros and makes ok() false.
class Reader {
  public:
    explicit Reader(std::string_view bytes) : bytes_(bytes) {}
    bool ok() const { return ok_; }
    bool at_end() const { return ok_ && bytes_.empty(); }

    std::string_view take(std::uint64_t count) {
        ok_ = ok_ && count <= bytes_.size();
        if (!ok_) return {};
        const std::string_view taken = bytes_.substr(0, count);
        bytes_.remove_prefix(count);
        return taken;
    }
    template <class T>
    T value() {
        T result{};
        const std::string_view from = take(sizeof(T));
        if (ok_) std::memcpy(&result, from.data(), sizeof(T));
        return result;
    }
    /// Reads a vector, whose length precedes it.
    template <class T>
    std::vector<T> list() {
        const auto count = value<std::uint64_t>();
        ok_ = ok_ && count <= bytes_.size() / sizeof(T);
        std::vector<T> values(ok_ ? count : 0);
        const std::string_view from = take(values.size() * sizeof(T));
        if (ok_ && !values.empty()) std::memcpy(values.data(), from.data(), from.size());
        return values;
    }
    /// Reads shuffled records of `each` values of T.
    template <class T>
    std::vector<T> shuffled(std::size_t records, std::size_t each = 1) {
        std::vector<T> values;
        const std::string_view from = take(records * each * sizeof(T));
        if (!ok_) return values;
        values.resize(records * each);
        unshuffle(from.data(), each * sizeof(T) / 4, records, reinterpret_cast<std::uint32_t*>(values.data()));
        return values;
    }

  private:
    std::string_view bytes_;
    bool ok_ = true;
};

// --- Pages -----------------------------------------------------------------------------------------------------------

/// Words of a pair as it is stored: id of the first triangle, difference of the ids, orders and flags, corners. A
/// corner is stored as the number of vertices of earlier pairs and corners, minus its index.
constexpr std::size_t kPairWords = 7;
constexpr std::uint32_t kFirstAlpha = 0x100, kSecondAlpha = 0x200;

std::size_t stored_bytes(const PageIndex::Size& size) {
    return std::size_t{size.nodes} * sizeof(rays::PageNode) + std::size_t{size.pairs} * kPairWords * 4 +
           std::size_t{size.vertices} * sizeof(vec3);
}

std::vector<std::uint32_t> stored_pairs(const std::vector<uvec4>& pairs) {
    std::vector<std::uint32_t> words;
    words.reserve(kPairWords * pairs.size());
    std::uint32_t vertices = 0;
    for (const uvec4& pair : pairs) {
        const std::uint32_t first = pair.x & shared::kBvhTriangleMask, second = pair.y & shared::kBvhTriangleMask;
        const std::uint32_t alpha = ((pair.x & shared::kBvhPageAlpha) != 0 ? kFirstAlpha : 0) |
                                    ((pair.y & shared::kBvhPageAlpha) != 0 ? kSecondAlpha : 0);
        words.insert(words.end(), {first, second - first,
                                   alpha | (pair.z >> shared::kBvhPageOrderShift) |
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
        for (std::uint32_t corner = 0; corner < 4; ++corner) {
            const std::uint32_t index = (vertices - words[i + 3 + corner]) & shared::kBvhPageCornerMask;
            pair[static_cast<int>(2 + corner / 2)] |= index << (corner % 2 * shared::kBvhPageCornerBits);
            vertices = std::max(vertices, index + 1);
        }
        pairs.push_back(pair);
    }
    return pairs;
}

// --- Blocks of table rows --------------------------------------------------------------------------------------------

/// Corners of a block as differences of successive places, which repeat where triangles form strips or quads.
std::vector<std::uint32_t> differences(const std::vector<std::array<std::uint16_t, 3>>& corners) {
    std::vector<std::uint32_t> steps;
    steps.reserve(3 * corners.size());
    std::uint32_t last = 0;
    for (const auto& triangle : corners)
        for (const std::uint32_t corner : triangle) steps.push_back(corner - std::exchange(last, corner));
    return steps;
}

/// Returns a decoded block; empty where its numbers contradict each other.
TableBlock decode_block(std::string_view bytes, std::uint32_t texels) {
    Reader reader(bytes);
    const auto triangles = reader.value<std::uint32_t>(), vertices = reader.value<std::uint32_t>();
    if (triangles > kTrianglesPerBlock || vertices > 3 * kTrianglesPerBlock) return {};
    const std::vector<std::uint32_t> steps = reader.shuffled<std::uint32_t>(3 * std::size_t{triangles});
    const std::vector<std::uint32_t> words = reader.shuffled<std::uint32_t>(triangles);
    std::vector<std::uint32_t> indices = reader.shuffled<std::uint32_t>(vertices);
    TableBlock block;
    block.positions = reader.shuffled<vec3>(vertices);
    block.attributes = reader.shuffled<vec4>(vertices, texels);
    if (!reader.at_end()) return {};
    std::inclusive_scan(indices.begin(), indices.end(), indices.begin());
    std::uint32_t corner = 0;
    for (std::size_t i = 0; i < triangles; ++i) {
        std::array<std::uint16_t, 3> corners;
        uvec4 row(0, 0, 0, words[i]);
        for (std::size_t k = 0; k < 3; ++k) {
            corner += steps[3 * i + k];
            if (corner >= vertices) return {};
            corners[k] = static_cast<std::uint16_t>(corner);
            row[static_cast<int>(k)] = indices[corner];
        }
        block.corners.push_back(corners);
        block.triangles.push_back(row);
    }
    return block;
}

/// Cache of decoded blocks, limited by their bytes. Thread-safe.
class BlockCache {
  public:
    explicit BlockCache(std::size_t bytes)
        : limit_(bytes / kShards), memory_(MemoryLedger::process(), MemoryPart::pages, bytes) {}

    using Entry = std::shared_ptr<const TableBlock>;

    /// Returns the block of an index, which load() reads where the cache lacks it.
    template <class Load>
    Entry get(std::uint32_t index, const Load& load) {
        Shard& shard = shards_[index % kShards];
        {
            const std::lock_guard lock(shard.mutex);
            const auto known = shard.places.find(index);
            if (known != shard.places.end()) {
                shard.recent.splice(shard.recent.begin(), shard.recent, known->second);
                return known->second->second;
            }
        }
        Entry entry = std::make_shared<const TableBlock>(load());  // unlocked: two threads may decode the same block
        const std::lock_guard lock(shard.mutex);
        const auto [place, fresh] = shard.places.try_emplace(index);
        if (!fresh) return place->second->second;
        shard.recent.emplace_front(index, entry);
        place->second = shard.recent.begin();
        shard.bytes += entry->bytes();
        while (shard.bytes > limit_ && shard.recent.size() > 1) {
            shard.bytes -= shard.recent.back().second->bytes();
            shard.places.erase(shard.recent.back().first);
            shard.recent.pop_back();
        }
        return entry;
    }

  private:
    static constexpr std::size_t kShards = 16;
    using Recent = std::list<std::pair<std::uint32_t, Entry>>;
    struct Shard {
        std::mutex mutex;
        Recent recent;  // latest use first
        std::unordered_map<std::uint32_t, Recent::iterator> places;
        std::size_t bytes = 0;
    };
    std::array<Shard, kShards> shards_;
    std::size_t limit_;  // bytes of a shard
    MemoryLedger::Entry memory_;
};

// --- Index -----------------------------------------------------------------------------------------------------------

/// Everything that the index holds. Offsets have one more element than there are blocks or pages.
struct StoredIndex {
    PageIndex index;
    std::vector<std::uint64_t> block_offsets, block_bytes;
    std::vector<std::uint64_t> page_offsets, page_bytes;
};

/// MeshRange without padding.
using RangeWords = std::array<std::uint32_t, 8>;
constexpr std::uint32_t kMerged = 1, kMoves = 2;
constexpr std::uint32_t kSlivers = 1, kAlpha = 2, kColors = 4, kTangents = 8;

static_assert(sizeof(PageRoot) == 36 && sizeof(PageIndex::Size) == 16 && sizeof(FileContent) == 24);

template <class T>
void append_list(const std::vector<T>& values, std::string& bytes) {
    const std::uint64_t count = values.size();
    append_bytes(&count, 1, bytes);
    append_bytes(values.data(), values.size(), bytes);
}

std::string bytes_of(const StoredIndex& stored) {
    const PageIndex& index = stored.index;
    std::string bytes;
    const auto add = [&](const auto& value) { append_bytes(&value, 1, bytes); };
    add(index.limits.bytes), add(index.limits.alpha_tested);
    add(index.alpha_tests), add(index.origin), add(index.bounds);
    add(index.triangles), add(index.vertices), add(index.vertex_texels), add(index.stack_entries);
    add((index.slivers ? kSlivers : 0) | (index.alpha ? kAlpha : 0) | (index.geometry.vertex_colors ? kColors : 0) |
        (index.geometry.tangents ? kTangents : 0));
    append_list(std::vector<std::uint8_t>(index.geometry.used_materials.begin(), index.geometry.used_materials.end()),
                bytes);
    append_list(index.geometry.emitters, bytes);
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

StoredIndex parse_index(Reader& reader) {
    StoredIndex stored;
    PageIndex& index = stored.index;
    const auto read = [&](auto& value) { value = reader.value<std::remove_reference_t<decltype(value)>>(); };
    read(index.limits.bytes), read(index.limits.alpha_tested);
    read(index.alpha_tests), read(index.origin), read(index.bounds);
    read(index.triangles), read(index.vertices), read(index.vertex_texels), read(index.stack_entries);
    const auto flags = reader.value<std::uint32_t>();
    index.slivers = (flags & kSlivers) != 0, index.alpha = (flags & kAlpha) != 0;
    const auto used = reader.list<std::uint8_t>();
    index.geometry.used_materials.assign(used.begin(), used.end());
    index.geometry.vertex_colors = (flags & kColors) != 0, index.geometry.tangents = (flags & kTangents) != 0;
    index.geometry.emitters = reader.list<std::uint32_t>();
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

/// Returns whether blocks of at most `most` bytes lie between the header and the index.
bool within(const std::vector<std::uint64_t>& offsets, const std::vector<std::uint64_t>& bytes, std::size_t most,
            const Header& header) {
    if (offsets.size() != bytes.size()) return false;
    for (std::size_t i = 0; i < offsets.size(); ++i)
        if (offsets[i] < sizeof(Header) || offsets[i] > header.index_offset || bytes[i] > most ||
            bytes[i] > header.index_offset - offsets[i])
            return false;
    return true;
}

/// Returns whether the numbers of an index agree with each other.
bool consistent(const StoredIndex& stored, const Header& header) {
    const PageIndex& index = stored.index;
    const std::uint64_t blocks = (std::uint64_t{index.triangles} + kTrianglesPerBlock - 1) / kTrianglesPerBlock;
    const std::uint32_t page_bytes = index.limits.bytes;
    if (page_bytes < kLeastPageBytes || page_bytes > kMostPageBytes || page_bytes % kPageByteSteps != 0 ||
        index.limits.alpha_tested >= kMostAlphaTested || index.vertex_texels < 1 ||
        index.vertex_texels > kMostVertexTexels || stored.block_offsets.size() != blocks ||
        stored.page_offsets.size() != index.pages.size() ||
        index.pages.size() > std::numeric_limits<std::uint32_t>::max() ||
        !within(stored.block_offsets, stored.block_bytes, most_compressed(kMostBlockBytes), header) ||
        !within(stored.page_offsets, stored.page_bytes, most_compressed(kPairWords * page_bytes), header))
        return false;
    for (const PageIndex::Size& size : index.pages)
        if (size.roots > size.nodes || size.nodes > kMostOfPage || size.pairs > kMostOfPage ||
            size.vertices > kMostOfPage || bytes_in_slot(size) > page_bytes)
            return false;
    const std::vector<std::uint32_t>& emitters = index.geometry.emitters;
    if (std::ranges::adjacent_find(emitters, std::greater_equal()) != emitters.end() ||
        (!emitters.empty() && emitters.back() >= index.triangles))
        return false;
    std::size_t root = 0;
    for (std::uint32_t page = 0; page < index.pages.size(); ++page) {
        for (std::uint32_t i = 0; i < index.pages[page].roots; ++i, ++root)
            if (root >= index.roots.size() || index.roots[root].page != page ||
                index.roots[root].node >= index.pages[page].nodes)
                return false;
    }
    if (root != index.roots.size()) return false;
    std::vector<std::uint8_t> children(index.above.size(), 0);
    const auto add_child = [&](std::uint32_t parent, std::size_t end) {
        return parent == PageRoot::kNoParent || (parent < end && ++children[parent] <= 4);
    };
    for (const PageRoot& r : index.roots)
        if (!add_child(r.parent, children.size())) return false;
    for (std::size_t i = 0; i < index.above.size(); ++i)
        if (!add_child(index.above[i], i)) return false;
    if (std::ranges::count(children, 0) > 0) return false;
    std::uint64_t triangles = 0, vertices = 0;
    for (const MeshRange& range : index.ranges) {
        if (range.first_triangle != triangles || range.first_vertex != vertices) return false;
        triangles += range.triangle_count;
        vertices += range.vertex_count;
    }
    return triangles == index.triangles && vertices == index.vertices;
}

Header read_header(const OpenFile& file, const std::string& subject) {
    std::string start(std::min<std::uint64_t>(file.size(), sizeof(Header)), '\0');
    file.read(0, start);
    const std::size_t known = std::min(start.size(), kMagic.size());
    if (known == 0 || !std::equal(kMagic.begin(), kMagic.begin() + known, start.begin()))
        throw DamagedPages(subject, "is not a page file");
    if (start.size() < sizeof(Header)) throw DamagedPages(subject, "is a truncated page file");
    Header header;
    std::memcpy(&header, start.data(), sizeof header);
    if (header.version != kPageFileVersion)
        throw DamagedPages(subject,
                           "is a page file of version {}, but version {} is needed; `halflight pack` makes it anew",
                           header.version, kPageFileVersion);
    if (header.checksum != header.sum() || header.triangles_per_block != kTrianglesPerBlock ||
        header.index_offset < sizeof(Header) || header.index_offset > header.file_bytes ||
        header.index_bytes != header.file_bytes - header.index_offset)
        throw DamagedPages(subject, "is a page file with a damaged header");
    if (header.file_bytes != file.size())
        throw DamagedPages(subject, "is a {} page file: it has {} bytes instead of {}",
                           file.size() < header.file_bytes ? "truncated" : "damaged", file.size(), header.file_bytes);
    return header;
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
    return compress(bytes, kLevel);
}

std::string encode(const Page& page) {
    std::string bytes;
    shuffle(words_of(page.nodes), 4 * shared::kBvhPageTexels, page.nodes.size() / shared::kBvhPageTexels, bytes);
    shuffle(stored_pairs(page.pairs).data(), kPairWords, page.pairs.size(), bytes);
    shuffle(words_of(page.vertices), 3, page.vertices.size(), bytes);
    return compress(bytes, kLevel);
}

PageFileWriter::PageFileWriter(const std::filesystem::path& temporary, std::string subject)
    : subject_(std::move(subject)), file_(temporary, subject_), end_(sizeof(Header)) {
    const std::string room(sizeof(Header), '\0');
    file_.write(room.data(), room.size());
}

PageFileWriter::Place PageFileWriter::append(std::string_view bytes) {
    file_.write(bytes.data(), bytes.size());
    return {std::exchange(end_, end_ + bytes.size()), bytes.size()};
}

void PageFileWriter::add_block(std::string_view encoded) {
    blocks_.push_back(append(encoded));
}

void PageFileWriter::add_page(std::string_view encoded, const PageIndex::Size& size) {
    pages_.push_back(append(encoded));
    page_sizes_.push_back(size);
}

PageFileSizes PageFileWriter::finish(PageIndex index) {
    StoredIndex stored{std::move(index), {}, {}, {}, {}};
    stored.index.pages = page_sizes_;
    PageFileSizes sizes;
    for (const Place& block : blocks_) {
        stored.block_offsets.push_back(block.offset), stored.block_bytes.push_back(block.bytes);
        sizes.tables += block.bytes;
    }
    for (const Place& page : pages_) {
        stored.page_offsets.push_back(page.offset), stored.page_bytes.push_back(page.bytes);
        sizes.pages += page.bytes;
    }
    const std::string bytes = bytes_of(stored);
    Header header;
    const Place place = append(compress(bytes, kLevel));
    header.index_offset = place.offset;
    header.index_bytes = place.bytes;
    header.index_raw_bytes = bytes.size();
    header.file_bytes = end_;
    header.checksum = header.sum();
    file_.seek(0);
    file_.write(&header, sizeof header);
    file_.close();
    sizes.index = place.bytes;
    sizes.file = end_;
    return sizes;
}

bool is_page_file(const std::filesystem::path& path) {
    const ByteSource source(path);
    std::string buffer;
    return source.size() >= kMagic.size() &&
           source.read(0, kMagic.size(), buffer) == std::string_view(kMagic.data(), kMagic.size());
}

struct PageFile::State {
    State(const std::filesystem::path& p, WhenDamaged w, std::size_t cache_bytes)
        : path(p), subject(p.string()), when_damaged(w), file(p), cache(cache_bytes) {
        const Header header = read_header(file, subject);
        MemoryLedger::process().check(header.index_bytes + 2 * header.index_raw_bytes, subject, "index of the pages");
        std::string frame(header.index_bytes, '\0'), bytes;
        file.read(header.index_offset, frame);
        if (!decompress(frame, header.index_raw_bytes, bytes)) throw DamagedPages(subject, "its index is damaged");
        Reader reader(bytes);
        stored = parse_index(reader);
        if (!reader.at_end() || !consistent(stored, header)) throw DamagedPages(subject, "its index is damaged");
        memory = {MemoryLedger::process(), MemoryPart::pages, bytes.size()};
        sizes = {header.file_bytes, std::reduce(stored.page_bytes.begin(), stored.page_bytes.end()),
                 std::reduce(stored.block_bytes.begin(), stored.block_bytes.end()), header.index_bytes};
    }

    TableBlock read_block(std::uint32_t index) const {
        thread_local std::string frame, bytes;
        frame.resize(stored.block_bytes[index]);
        file.read(stored.block_offsets[index], frame);
        TableBlock block;
        if (decompress(frame, kMostBlockBytes, bytes)) block = decode_block(bytes, stored.index.vertex_texels);
        const std::size_t expected =
            std::min<std::size_t>(kTrianglesPerBlock, stored.index.triangles - std::size_t{index} * kTrianglesPerBlock);
        if (block.triangles.size() != expected) fail(fmt::format("block {} of its table rows", index));
        return block;
    }

    /// Throws the error of a damaged part.
    [[noreturn]] void fail(const std::string& part) const {
        std::error_code kept;
        const bool removed = when_damaged == WhenDamaged::remove && std::filesystem::remove(path, kept);
        throw DamagedPages(subject, "{} is damaged{}", part,
                           removed ? "; the file has been removed, and the next start makes it anew" : "");
    }

    std::filesystem::path path;
    std::string subject;
    WhenDamaged when_damaged;
    OpenFile file;
    StoredIndex stored;
    PageFileSizes sizes;
    MemoryLedger::Entry memory;
    mutable BlockCache cache;
};

PageFile::PageFile(const std::filesystem::path& path, WhenDamaged when_damaged, std::size_t cache_bytes)
    : state_(std::make_unique<State>(path, when_damaged, cache_bytes)) {}
PageFile::PageFile(PageFile&&) noexcept = default;
PageFile::~PageFile() = default;

const std::filesystem::path& PageFile::path() const {
    return state_->path;
}

const PageIndex& PageFile::index() const {
    return state_->stored.index;
}

PageFileSizes PageFile::sizes() const {
    return state_->sizes;
}

Page PageFile::read(std::uint32_t page) const {
    assert(page < index().pages.size());
    const PageIndex::Size& count = index().pages[page];
    thread_local std::string frame, bytes;
    frame.resize(state_->stored.page_bytes[page]);
    state_->file.read(state_->stored.page_offsets[page], frame);
    const std::size_t size = stored_bytes(count);
    if (!decompress(frame, size, bytes) || bytes.size() != size) state_->fail(fmt::format("page {}", page));
    Page result;
    result.roots = count.roots;
    Reader reader(bytes);
    result.nodes = reader.shuffled<uvec4>(count.nodes, shared::kBvhPageTexels);
    result.pairs = pairs_of(reader.shuffled<std::uint32_t>(count.pairs, kPairWords));
    result.vertices = reader.shuffled<vec3>(count.vertices);
    return result;
}

void PageFile::read_rows(std::span<const std::uint32_t> triangles, TriangleRows& rows) const {
    const std::size_t texels = index().vertex_texels;
    rows.triangles.resize(triangles.size());
    rows.positions.resize(3 * triangles.size());
    rows.attributes.resize(3 * texels * triangles.size());
    // Sorted, so that each block is read once.
    std::vector<std::uint32_t> order(triangles.size());
    std::iota(order.begin(), order.end(), 0u);
    std::ranges::sort(order, {}, [&](std::uint32_t i) { return triangles[i]; });
    BlockCache::Entry block;
    std::uint32_t current = 0;
    for (const std::uint32_t i : order) {
        assert(triangles[i] < index().triangles);
        const std::uint32_t wanted = triangles[i] / kTrianglesPerBlock;
        if (!block || wanted != current) block = state_->cache.get(wanted, [&] { return state_->read_block(wanted); });
        current = wanted;
        const std::size_t row = triangles[i] % kTrianglesPerBlock;
        rows.triangles[i] = block->triangles[row];
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t corner = block->corners[row][k];
            rows.positions[3 * i + k] = block->positions[corner];
            std::copy_n(&block->attributes[corner * texels], texels, &rows.attributes[(3 * i + k) * texels]);
        }
    }
}

}  // namespace halflight::paging
