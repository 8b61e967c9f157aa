// Images whose texels are not in memory, cut into square tiles.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/math.h"
#include "engine/scene/scene.h"

namespace halflight {

/// The texels of an image, which are read tile by tile. Columns are groups of four bytes (TextureImage::pitch()).
class ImageTiles {
  public:
    static constexpr int kSide = 32;                                       // texels along an edge of a tile
    static constexpr std::size_t kBytes = std::size_t{4} * kSide * kSide;  // bytes of a tile
    static int count(int texels) { return (texels + kSide - 1) / kSide; }  ///< Returns the tiles along an edge.

    virtual ~ImageTiles() = default;
    /// Reads a tile as kSide rows of RGBA. Texels beyond the image are 0. Returns the bytes that were read from the
    /// file. Thread-safe. Throws Error if the tile cannot be read.
    virtual std::size_t read(ivec2 tile, std::span<std::uint8_t> rgba) const = 0;
    /// Returns the bytes that the object takes in memory.
    virtual std::size_t bytes() const = 0;
};

/// Returns all texels of an image, which is in memory or in tiles.
std::vector<std::uint8_t> all_texels(const TextureImage& image);
/// Returns a texel of an image, which is in memory or in tiles: RGBA, [0, 1].
std::array<double, 4> texel_of(const TextureImage& image, ivec2 texel);

}  // namespace halflight
