// Texel pools and texture descriptors (shaders/shared/texture_rows.h).
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "engine/tables/shading_tables.h"

namespace halflight {

/// Values of the colour pool by the codes of an image: half floats.
struct ColorHalves {
    std::vector<std::uint16_t> linear;  // decoded from sRGB
    std::vector<std::uint16_t> alpha;

    std::array<std::uint16_t, 4> of(const TextureImage& image, const std::uint8_t* texel) const {
        const auto code = [&](std::size_t c) { return image.code(texel, c); };
        return {linear[code(0)], linear[code(1)], linear[code(2)], alpha[code(3)]};
    }
};
/// Returns the values of codes of 8 bits, or of 16 bits if they are deep.
const ColorHalves& color_halves(bool deep);

/// Allocator of images in the texel pools of `tables`, when they are first referred to. Every pair of image and use is
/// stored once, and so is every descriptor.
class TexturePools {
  public:
    TexturePools(const Scene& scene, ShadingTables& tables);

    /// Returns the index of a descriptor of a colour, decoded from sRGB. Throws Error if the pool would exceed 2^31
    /// texels, or 2^31 tiles. pinned: PooledImage.
    std::uint32_t color(const TextureRef& texture, bool pinned) { return add(texture, true, pinned); }
    /// Returns the index of a descriptor of data, with the same limit.
    std::uint32_t data(const TextureRef& texture, bool pinned) { return add(texture, false, pinned); }
    /// Fills the pools, or the list of tiled textures. Call it after all calls of color() and data().
    void fill();

  private:
    std::uint32_t add(const TextureRef& texture, bool is_color, bool pinned);
    std::uint32_t first_texel(int image, bool is_color, bool pinned);
    std::uint32_t count_of(const TextureImage& level, bool is_color) const;
    TiledTexture tiled(const TextureImage& level, bool is_color, bool pinned) const;
    std::vector<const TextureImage*> levels_of(int image, bool is_color) const;

    struct Place {
        std::uint32_t first = 0;  // first texel in the pool, or first tile
        std::size_t pooled = 0;   // index into ShadingTables::pooled
    };
    const Scene& scene_;
    ShadingTables& tables_;
    const bool tiles_;  // the scene's images are in tiles
    std::map<std::pair<int, bool>, Place> places_;
    std::uint64_t tile_count_ = 0;
    std::size_t color_texels_ = 0;
    std::size_t data_texels_ = 0;
    std::map<std::pair<std::string, bool>, std::uint32_t>
        descriptors_;  // index by the bytes of a descriptor and whether the texture is a colour
};

}  // namespace halflight
