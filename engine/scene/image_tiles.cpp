#include "engine/scene/image_tiles.h"

#include <algorithm>

namespace halflight {

std::vector<std::uint8_t> all_texels(const TextureImage& image) {
    if (!image.tiles) return image.rgba.get();
    constexpr int kSide = ImageTiles::kSide;
    const auto width = static_cast<std::size_t>(image.width);
    std::vector<std::uint8_t> rgba(4 * width * static_cast<std::size_t>(image.height));
    std::vector<std::uint8_t> tile(ImageTiles::kBytes);
    for (int ty = 0; ty < ImageTiles::count(image.height); ++ty) {
        for (int tx = 0; tx < ImageTiles::count(image.width); ++tx) {
            image.tiles->read({tx, ty}, tile);
            const int columns = std::min(kSide, image.width - tx * kSide);
            for (int y = 0; y < std::min(kSide, image.height - ty * kSide); ++y) {
                const std::size_t row = static_cast<std::size_t>(ty * kSide + y);
                std::copy_n(&tile[static_cast<std::size_t>(4 * kSide * y)], 4 * columns,
                            &rgba[4 * (row * width + static_cast<std::size_t>(tx * kSide))]);
            }
        }
    }
    return rgba;
}

std::array<std::uint8_t, 4> texel_of(const TextureImage& image, ivec2 texel) {
    std::vector<std::uint8_t> tile;
    const std::uint8_t* rgba = nullptr;
    if (image.tiles) {
        tile.resize(ImageTiles::kBytes);
        image.tiles->read(texel / ImageTiles::kSide, tile);
        const ivec2 within = texel % ImageTiles::kSide;
        rgba = &tile[static_cast<std::size_t>(4 * (within.y * ImageTiles::kSide + within.x))];
    } else {
        rgba = &image.rgba[4 * (static_cast<std::size_t>(texel.y) * static_cast<std::size_t>(image.width) +
                                static_cast<std::size_t>(texel.x))];
    }
    return {rgba[0], rgba[1], rgba[2], rgba[3]};
}

}  // namespace halflight
