#include "engine/io/texture_store.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "engine/core/cache_folder.h"
#include "engine/core/error.h"
#include "engine/core/hash.h"
#include "engine/io/zstd_frame.h"

namespace halflight {
namespace {

constexpr int kLevel = 1;  // level of Zstandard's compression, the fastest
constexpr std::size_t kTexels = ImageTiles::kBytes / 4;
constexpr std::uint32_t kVersion = 2;  // version of cached files; changes if decoders or levels give other texels
constexpr std::uint64_t kMagic = 0x31454c4954464c48;  // HLFTILE1
constexpr int kMostOpen = 512;                        // files of the cache; processes can often open 1024
constexpr int kMostSide = 65536;                      // texels along an edge

/// End of a file of the cache.
struct Footer {
    std::uint64_t magic, index, index_bytes;
};
static_assert(sizeof(Footer) == 24);

/// Places of the tiles of one level. Tiles of a row lie behind each other in the file.
struct LevelIndex {
    std::int32_t width = 0, height = 0;  // width: TextureImage::pitch()
    bool deep = false;
    std::vector<std::uint64_t> rows;  // per row of tiles: place in the file
    std::vector<std::uint32_t> ends;  // per tile: end of its frame, bytes from the row's place
};

/// Sorts the bytes of a tile by channel, as differences to the texel before, which halves what Zstandard leaves.
std::string planes_of(const TextureImage& image, ivec2 tile) {
    constexpr int kSide = ImageTiles::kSide;
    std::string planes(ImageTiles::kBytes, '\0');
    const ivec2 size = glm::min(ivec2(kSide), ivec2(image.pitch(), image.height) - tile * kSide);
    std::uint8_t last[2][4] = {};
    for (int y = 0; y < kSide; ++y) {
        const std::size_t row = static_cast<std::size_t>(std::min(y, size.y - 1) + tile.y * kSide);
        const std::uint8_t* from =
            &image.rgba[4 * (row * static_cast<std::size_t>(image.pitch()) + static_cast<std::size_t>(tile.x * kSide))];
        for (int x = 0; x < kSide; ++x) {
            const bool inside = x < size.x && y < size.y;
            for (std::size_t c = 0; c < 4; ++c) {
                const std::uint8_t value = inside ? from[4 * static_cast<std::size_t>(x) + c] : std::uint8_t{0};
                planes[c * kTexels + static_cast<std::size_t>(y * kSide + x)] =
                    static_cast<char>(value - std::exchange(last[image.deep ? x % 2 : 0][c], value));
            }
        }
    }
    return planes;
}

/// Reverses planes_of().
void texels_of(const std::string& planes, bool deep, std::span<std::uint8_t> rgba) {
    std::uint8_t last[2][4] = {};
    for (std::size_t i = 0; i < kTexels; ++i)
        for (std::size_t c = 0; c < 4; ++c) {
            std::uint8_t& value = last[deep ? i % 2 : 0][c];
            rgba[4 * i + c] = value =
                static_cast<std::uint8_t>(value + static_cast<std::uint8_t>(planes[c * kTexels + i]));
        }
}

/// Compresses the tiles of a level. append: writes a row of tiles and returns its place.
LevelIndex cut(const TextureImage& image, const std::function<std::uint64_t(const std::string&)>& append) {
    LevelIndex index{image.pitch(), image.height, image.deep, {}, {}};
    std::string row;
    for (int y = 0; y < ImageTiles::count(image.height); ++y) {
        row.clear();
        for (int x = 0; x < ImageTiles::count(image.pitch()); ++x) {
            row += compress(planes_of(image, {x, y}), kLevel);
            index.ends.push_back(static_cast<std::uint32_t>(row.size()));
        }
        index.rows.push_back(append(row));
    }
    return index;
}

/// Writes numbers and arrays of numbers as bytes.
struct IndexBytes {
    std::string bytes;
    template <class T>
    void add(const T& value) {
        static_assert(std::is_arithmetic_v<T>);
        bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
    void add(const LevelIndex& level) {
        add(level.width), add(level.height), add(level.deep);
        for (const std::uint64_t row : level.rows) add(row);
        for (const std::uint32_t end : level.ends) add(end);
    }
};

/// Reads what IndexBytes has written. After the end it reads 0 and fails.
struct IndexReader {
    std::string_view left;
    bool failed = false;
    template <class T>
    T next() {
        T value{};
        failed = failed || left.size() < sizeof value;
        if (failed) return value;
        std::memcpy(&value, left.data(), sizeof value);
        left.remove_prefix(sizeof value);
        return value;
    }
    /// Reads a level whose tiles lie before `end`.
    LevelIndex level(std::uint64_t end) {
        LevelIndex level{next<std::int32_t>(), next<std::int32_t>(), false, {}, {}};
        const auto deep = next<std::uint8_t>();
        level.deep = deep == 1;
        const auto is_side = [](int side) { return side > 0 && side <= kMostSide; };
        failed = failed || deep > 1 || !is_side(level.height) || !is_side(level.deep ? level.width / 2 : level.width) ||
                 (level.deep && level.width % 2 != 0);
        if (failed) return level;
        const auto columns = static_cast<std::size_t>(ImageTiles::count(level.width));
        const auto rows = static_cast<std::size_t>(ImageTiles::count(level.height));
        failed = left.size() < rows * sizeof(std::uint64_t) + rows * columns * sizeof(std::uint32_t);
        for (std::size_t y = 0; y < rows && !failed; ++y) level.rows.push_back(next<std::uint64_t>());
        for (std::size_t i = 0; i < rows * columns && !failed; ++i) {
            const std::uint32_t first = i % columns == 0 ? 0 : level.ends.back();
            level.ends.push_back(next<std::uint32_t>());
            const std::uint64_t row = level.rows[i / columns];
            failed = failed || level.ends.back() < first ||
                     level.ends.back() - first > most_compressed(ImageTiles::kBytes) || row > end ||
                     level.ends.back() > end - row;
        }
        return level;
    }
};

}  // namespace

/// A file of tiles.
struct TextureStore::Source {
    virtual ~Source() = default;
    virtual void read(std::uint64_t offset, std::span<char> to) const = 0;
    /// Throws Error about a damaged tile, "tile 1, 2 of wood.png".
    [[noreturn]] virtual void report(const std::string& tile) const = 0;
};

struct TextureStore::Scratch final : Source {
    explicit Scratch(const std::filesystem::path& f)
        : folder(f), file(folder, folder.string() + ": temporary file of textures") {}
    void read(std::uint64_t offset, std::span<char> to) const override { file.read(offset, to); }
    [[noreturn]] void report(const std::string& tile) const override {
        throw Error(folder.string(), "the temporary file of textures is damaged ({})", tile);
    }
    std::filesystem::path folder;
    ScratchFile file;
    mutable std::mutex mutex;  // held while the file grows
};

struct TextureStore::Cached final : Source {
    explicit Cached(const std::filesystem::path& p) : path(p), file(p) {}
    void read(std::uint64_t offset, std::span<char> to) const override { file.read(offset, to); }
    [[noreturn]] void report(const std::string& tile) const override {
        std::error_code ignored;
        std::filesystem::remove(path, ignored);
        throw Error(path.string(), "this file of textures is damaged ({}); the next start makes it anew", tile);
    }
    std::filesystem::path path;
    OpenFile file;
};

/// The tiles of a level in a file.
class TextureStore::Tiles final : public ImageTiles {
  public:
    Tiles(std::shared_ptr<const Source> source, std::string name, LevelIndex index)
        : source_(std::move(source)), name_(std::move(name)), index_(std::move(index)) {}

    std::size_t read(ivec2 tile, std::span<std::uint8_t> rgba) const override {
        const auto row = static_cast<std::size_t>(tile.y);
        const std::size_t index =
            row * static_cast<std::size_t>(count(index_.width)) + static_cast<std::size_t>(tile.x);
        const std::uint32_t first = tile.x == 0 ? 0 : index_.ends[index - 1];
        std::string frame(index_.ends[index] - first, '\0'), planes;
        source_->read(index_.rows[row] + first, frame);
        if (!decompress(frame, kBytes, planes) || planes.size() != kBytes)
            source_->report(fmt::format("tile {}, {} of {}", tile.x, tile.y, name_));
        texels_of(planes, index_.deep, rgba);
        return frame.size();
    }

    std::size_t bytes() const override {
        return index_.ends.size() * sizeof(std::uint32_t) + index_.rows.size() * sizeof(std::uint64_t);
    }

  private:
    std::shared_ptr<const Source> source_;
    std::string name_;
    LevelIndex index_;
};

TextureStore::TextureStore(const std::filesystem::path& folder, std::filesystem::path cache)
    : cache_(std::move(cache)), scratch_(std::make_shared<Scratch>(folder)) {
    std::error_code error;
    if (!cache_.empty()) std::filesystem::create_directories(cache_, error);
    if (error) cache_.clear();
}

std::uint64_t TextureStore::key(std::string_view encoded, const LevelUses& uses) {
    Hash hash;
    hash.add_bytes(encoded.data(), encoded.size());
    hash.add(std::uint64_t{encoded.size()});
    hash.add(std::uint32_t{kVersion});
    hash.add(std::uint32_t{(uses.color ? 1u : 0u) | (uses.data ? 2u : 0u) | (uses.normal ? 4u : 0u)});
    return std::max(hash.value(), std::uint64_t{1});
}

std::filesystem::path TextureStore::file_of(std::uint64_t key) const {
    return cache_ / fmt::format("{:016x}-{}.tiles", key, kVersion);
}

bool TextureStore::find(std::uint64_t key, TextureImage& image) {
    std::error_code error;
    const std::filesystem::path path = cache_.empty() ? cache_ : file_of(key);
    if (path.empty() || !std::filesystem::exists(path, error) || open_ >= kMostOpen) return false;
    try {
        auto source = std::make_shared<Cached>(path);
        const std::uint64_t size = source->file.size();
        Footer footer{};
        if (size < sizeof footer) return false;
        source->read(size - sizeof footer, {reinterpret_cast<char*>(&footer), sizeof footer});
        const std::uint64_t before = size - sizeof footer;
        if (footer.magic != kMagic || footer.index > before || footer.index_bytes != before - footer.index)
            return false;
        constexpr std::uint64_t kMostIndex = std::uint64_t{1} << 30;  // bytes; more than kMostSide gives
        if (footer.index_bytes > kMostIndex) return false;
        std::string frame(footer.index_bytes, '\0'), bytes;
        source->read(footer.index, frame);
        if (!decompress(frame, kMostIndex, bytes)) return false;
        IndexReader reader{bytes};
        if (reader.next<std::uint64_t>() != key) return false;
        const auto color = reader.next<std::uint32_t>(), data = reader.next<std::uint32_t>();
        if (std::max(color, data) > 32) return false;
        TextureImage found{.name = image.name, .width = 0, .height = 0, .rgba = {}};
        const auto take_level = [&](TextureImage& level) {
            LevelIndex index = reader.level(footer.index);
            level.name = image.name, level.deep = index.deep;
            level.width = index.deep ? index.width / 2 : index.width, level.height = index.height;
            level.tiles = std::make_shared<Tiles>(source, image.name, std::move(index));
        };
        take_level(found);
        found.color_levels.resize(color), found.data_levels.resize(data);
        for (auto* levels : {&found.color_levels, &found.data_levels}) std::ranges::for_each(*levels, take_level);
        if (reader.failed || !reader.left.empty()) return false;
        image = std::move(found);
    } catch (const Error&) {
        return false;
    }
    ++open_;
    std::filesystem::last_write_time(path, std::filesystem::file_time_type::clock::now(), error);  // the last use
    return true;
}

/// Returns false if the cache cannot be written.
bool TextureStore::add_to_cache(const TextureImage& image, std::uint64_t key) const {
    const std::filesystem::path path = file_of(key);
    remove_abandoned({&path, 1});
    try {
        write_unnamed(path, [&](const std::filesystem::path& temporary) {
            CheckedFile file(temporary, path.string());
            IndexBytes index;
            index.add(key);
            index.add(static_cast<std::uint32_t>(image.color_levels.size()));
            index.add(static_cast<std::uint32_t>(image.data_levels.size()));
            std::uint64_t end = 0;
            const auto append = [&](const std::string& bytes) {
                file.write(bytes.data(), bytes.size());
                return std::exchange(end, end + bytes.size());
            };
            index.add(cut(image, append));
            for (const auto* levels : {&image.color_levels, &image.data_levels})
                for (const TextureImage& level : *levels) index.add(cut(level, append));
            const std::string frame = compress(index.bytes, kLevel);
            const Footer footer{kMagic, append(frame), frame.size()};
            file.write(&footer, sizeof footer);
            file.close();
        });
        return true;
    } catch (const Error&) {
        return false;
    }
}

void TextureStore::take(TextureImage& image, std::uint64_t key) {
    if (key != 0 && !cache_.empty() && open_ < kMostOpen && add_to_cache(image, key) && find(key, image)) return;
    const auto append = [&](const std::string& row) {
        const std::lock_guard lock(scratch_->mutex);
        const std::uint64_t offset = scratch_->file.size();
        scratch_->file.append(row);
        return offset;
    };
    const auto move_level = [&](TextureImage& level) {
        level.tiles = std::make_shared<Tiles>(scratch_, image.name, cut(level, append));
        level.rgba = {};
    };
    move_level(image);
    for (auto* levels : {&image.color_levels, &image.data_levels}) std::ranges::for_each(*levels, move_level);
}

void TextureStore::trim() const {
    if (!cache_.empty()) trim_cache(cache_, ".tiles");
}

std::uint64_t TextureStore::bytes() const {
    const std::lock_guard lock(scratch_->mutex);
    return scratch_->file.size();
}

}  // namespace halflight
