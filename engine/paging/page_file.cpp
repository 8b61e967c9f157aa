#include "engine/paging/page_file.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cstring>
#include <list>
#include <mutex>
#include <numeric>
#include <optional>
#include <type_traits>
#include <unordered_map>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/hash.h"
#include "engine/core/memory_ledger.h"
#include "engine/io/zstd_frame.h"
#include "engine/paging/page_file_index.h"

namespace halflight::paging {
namespace {

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
static_assert(sizeof(Header) == kPageHeaderBytes && std::is_trivially_copyable_v<Header>);

/// Most bytes of an index that is not compressed; sums of sizes then fit into 64 bits.
constexpr std::uint64_t kMostIndexBytes = std::uint64_t{1} << 40;
/// Most bytes that a byte of a Zstandard frame stands for: 4 bytes are a block, which has 128 KiB at most.
constexpr std::uint64_t kMostRatio = (std::uint64_t{128} << 10) / 4;

/// Cache of decoded blocks, limited by their bytes. Thread-safe.
class BlockCache {
  public:
    explicit BlockCache(std::size_t bytes)
        : limit_(bytes / kShards), memory_(MemoryLedger::process(), MemoryPart::pages, bytes) {}

    using Entry = std::shared_ptr<const TableBlock>;

    /// Returns the block of an index, which load() reads if the cache lacks it.
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
        if (const auto known = shard.places.find(index); known != shard.places.end()) return known->second->second;
        shard.recent.emplace_front(index, entry);
        try {
            shard.places.emplace(index, shard.recent.begin());
        } catch (...) {  // there is no memory
            shard.recent.pop_front();
            throw;
        }
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
        header.index_bytes != header.file_bytes - header.index_offset || header.index_raw_bytes > kMostIndexBytes ||
        header.index_raw_bytes / kMostRatio > header.index_bytes)
        throw DamagedPages(subject, "is a page file with a damaged header");
    if (header.file_bytes != file.size())
        throw DamagedPages(subject, "is a {} page file: it has {} bytes instead of {}",
                           file.size() < header.file_bytes ? "truncated" : "damaged", file.size(), header.file_bytes);
    return header;
}

}  // namespace

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
    const Place place = append(compress(bytes, kCompressionLevel));
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
        : named(versioned(p)), subject(p.string()), when_damaged(w), file(p), cache(cache_bytes) {
        const Header header = read_header(file, subject);
        MemoryLedger::process().check(header.index_bytes + 2 * header.index_raw_bytes, subject, "index of the pages");
        std::string frame(header.index_bytes, '\0'), bytes;
        file.read(header.index_offset, frame);
        std::optional<StoredIndex> parsed;
        if (decompress(frame, header.index_raw_bytes, bytes) && bytes.size() == header.index_raw_bytes)
            parsed = parse_index(bytes, header.index_offset);
        if (!parsed) throw DamagedPages(subject, "its index is damaged");
        stored = std::move(*parsed);
        memory = {MemoryLedger::process(), MemoryPart::pages, bytes.size()};
        sizes = {header.file_bytes, std::reduce(stored.page_bytes.begin(), stored.page_bytes.end()),
                 std::reduce(stored.block_bytes.begin(), stored.block_bytes.end()), header.index_bytes};
    }

    TableBlock read_block(std::uint32_t index) const {
        thread_local std::string frame, bytes;
        frame.resize(stored.block_bytes[index]);
        file.read(stored.block_offsets[index], frame);
        std::optional<TableBlock> block;
        if (decompress(frame, kMostBlockBytes, bytes)) block = decode_block(bytes, stored.index);
        const std::size_t expected =
            std::min<std::size_t>(kTrianglesPerBlock, stored.index.triangles - std::size_t{index} * kTrianglesPerBlock);
        if (!block || block->triangles.size() != expected) fail(fmt::format("block {} of its table rows", index));
        return std::move(*block);
    }

    /// Returns whether the name still leads to the file that was opened.
    bool is_named() const {
        const VersionedFile now = versioned(named.path);
        return std::equal(now.version.begin(), now.version.begin() + 2, named.version.begin());
    }

    /// Throws the error of a damaged part. A file that has got the name since is not removed.
    [[noreturn]] void fail(const std::string& part) const {
        std::error_code kept;
        const bool removed =
            when_damaged == WhenDamaged::remove && is_named() && std::filesystem::remove(named.path, kept);
        throw DamagedPages(subject, "{} is damaged{}", part,
                           removed ? "; the file has been removed, and the next start makes it anew" : "");
    }

    VersionedFile named;  // noted before the file is opened
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
    return state_->named.path;
}

std::string PageFile::subject() const {
    return state_->subject;
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
    std::optional<Page> result;
    if (decompress(frame, decoded_bytes(count), bytes)) result = decode_page(bytes, count);
    if (!result) state_->fail(fmt::format("page {}", page));
    return std::move(*result);
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

void PageFile::check(const std::function<void()>& pulse) const {
    tbb::parallel_for(std::size_t{0}, index().pages.size(), [&](std::size_t page) {
        pulse();
        read(static_cast<std::uint32_t>(page));
    });
    const std::uint32_t blocks = (index().triangles + kTrianglesPerBlock - 1) / kTrianglesPerBlock;
    tbb::parallel_for(std::uint32_t{0}, blocks, [&](std::uint32_t block) {
        pulse();
        state_->read_block(block);
    });
}

}  // namespace halflight::paging
