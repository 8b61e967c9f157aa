#include "engine/scene/image_tiles.h"

#include <algorithm>

namespace halflight {

std::vector<std::uint8_t> all_texels(const TextureImage& image) {
    if (!image.tiles) return image.rgba.get();
    constexpr int kSide = ImageTiles::kSide;
    const auto width = static_cast<std::size_t>(image.pitch());
    std::vector<std::uint8_t> rgba(4 * width * static_cast<std::size_t>(image.height));
    std::vector<std::uint8_t> tile(ImageTiles::kBytes);
    for (int ty = 0; ty < ImageTiles::count(image.height); ++ty) {
        for (int tx = 0; tx < ImageTiles::count(image.pitch()); ++tx) {
            image.tiles->read({tx, ty}, tile);
            const int columns = std::min(kSide, image.pitch() - tx * kSide);
            for (int y = 0; y < std::min(kSide, image.height - ty * kSide); ++y) {
                const std::size_t row = static_cast<std::size_t>(ty * kSide + y);
                std::copy_n(&tile[static_cast<std::size_t>(4 * kSide * y)], 4 * columns,
                            &rgba[4 * (row * width + static_cast<std::size_t>(tx * kSide))]);
            }
        }
    }
    return rgba;
}

std::array<double, 4> texel_of(const TextureImage& image, ivec2 texel) {
    std::vector<std::uint8_t> tile;
    const std::uint8_t* bytes = nullptr;
    const ivec2 place(image.deep ? 2 * texel.x : texel.x, texel.y);
    if (image.tiles) {
        tile.resize(ImageTiles::kBytes);
        image.tiles->read(place / ImageTiles::kSide, tile);
        const ivec2 within = place % ImageTiles::kSide;
        bytes = &tile[static_cast<std::size_t>(4 * (within.y * ImageTiles::kSide + within.x))];
    } else {
        bytes = &image.rgba[4 * (static_cast<std::size_t>(place.y) * static_cast<std::size_t>(image.pitch()) +
                                 static_cast<std::size_t>(place.x))];
    }
    std::array<double, 4> values;
    for (std::size_t c = 0; c < 4; ++c) values[c] = double(image.code(bytes, c)) / image.largest();
    return values;
}

}  // namespace halflight
