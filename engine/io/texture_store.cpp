#include "engine/io/texture_store.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "engine/core/error.h"
#include "engine/io/zstd_frame.h"

namespace halflight {
namespace {

constexpr int kLevel = 1;  // level of Zstandard's compression, the fastest
constexpr std::size_t kTexels = ImageTiles::kBytes / 4;

/// Sorts the bytes of a tile by channel, as differences to the texel before, which halves what Zstandard leaves.
std::string planes_of(const TextureImage& image, ivec2 tile) {
    constexpr int kSide = ImageTiles::kSide;
    std::string planes(ImageTiles::kBytes, '\0');
    const ivec2 size = glm::min(ivec2(kSide), ivec2(image.width, image.height) - tile * kSide);
    std::uint8_t last[4] = {};
    for (int y = 0; y < kSide; ++y) {
        const std::size_t row = static_cast<std::size_t>(std::min(y, size.y - 1) + tile.y * kSide);
        const std::uint8_t* from =
            &image.rgba[4 * (row * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(tile.x * kSide))];
        for (int x = 0; x < kSide; ++x) {
            const bool inside = x < size.x && y < size.y;
            for (std::size_t c = 0; c < 4; ++c) {
                const std::uint8_t value = inside ? from[4 * static_cast<std::size_t>(x) + c] : std::uint8_t{0};
                planes[c * kTexels + static_cast<std::size_t>(y * kSide + x)] =
                    static_cast<char>(value - std::exchange(last[c], value));
            }
        }
    }
    return planes;
}

/// Reverses planes_of().
void texels_of(const std::string& planes, std::span<std::uint8_t> rgba) {
    std::uint8_t last[4] = {};
    for (std::size_t i = 0; i < kTexels; ++i)
        for (std::size_t c = 0; c < 4; ++c)
            rgba[4 * i + c] = last[c] =
                static_cast<std::uint8_t>(last[c] + static_cast<std::uint8_t>(planes[c * kTexels + i]));
}

}  // namespace

/// The tiles of an image in the store. Tiles of a row lie behind each other in the file.
class TextureStore::Tiles final : public ImageTiles {
  public:
    Tiles(std::shared_ptr<const TextureStore> store, std::string name, int columns)
        : store_(std::move(store)), name_(std::move(name)), columns_(columns) {}

    void add_row(std::uint64_t offset, const std::vector<std::uint32_t>& ends) {
        rows_.push_back(offset);
        ends_.insert(ends_.end(), ends.begin(), ends.end());
    }

    std::size_t read(ivec2 tile, std::span<std::uint8_t> rgba) const override {
        const std::size_t index =
            static_cast<std::size_t>(tile.y) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(tile.x);
        const std::uint32_t first = tile.x == 0 ? 0 : ends_[index - 1];
        std::string frame(ends_[index] - first, '\0'), planes;
        store_->file_.read(rows_[static_cast<std::size_t>(tile.y)] + first, frame);
        if (!decompress(frame, kBytes, planes) || planes.size() != kBytes)
            throw Error(store_->folder_.string(), "the temporary file of textures is damaged (tile {}, {} of {})",
                        tile.x, tile.y, name_);
        texels_of(planes, rgba);
        return frame.size();
    }

    std::size_t bytes() const override {
        return ends_.size() * sizeof(std::uint32_t) + rows_.size() * sizeof(std::uint64_t);
    }

  private:
    std::shared_ptr<const TextureStore> store_;
    std::string name_;
    int columns_;
    std::vector<std::uint64_t> rows_;  // per row of tiles: place in the file
    std::vector<std::uint32_t> ends_;  // per tile: end of its frame, bytes from the row's place
};

TextureStore::TextureStore(const std::filesystem::path& folder)
    : folder_(folder), file_(folder, folder.string() + ": temporary file of textures") {}

void TextureStore::take(TextureImage& image) {
    for (auto* levels : {&image.color_levels, &image.data_levels})
        for (TextureImage& level : *levels) take(level);
    const ivec2 count(ImageTiles::count(image.width), ImageTiles::count(image.height));
    auto tiles = std::make_shared<Tiles>(shared_from_this(), image.name, count.x);
    std::string row;
    std::vector<std::uint32_t> ends;
    for (int y = 0; y < count.y; ++y) {
        row.clear();
        ends.clear();
        for (int x = 0; x < count.x; ++x) {
            row += compress(planes_of(image, {x, y}), kLevel);
            ends.push_back(static_cast<std::uint32_t>(row.size()));
        }
        const std::lock_guard lock(mutex_);
        const std::uint64_t offset = file_.size();
        file_.append(row);
        tiles->add_row(offset, ends);
    }
    image.tiles = std::move(tiles);
    std::vector<std::uint8_t>().swap(image.rgba);
}

std::uint64_t TextureStore::bytes() const {
    const std::lock_guard lock(mutex_);
    return file_.size();
}

}  // namespace halflight
