// Where the rays of a batch lie in the targets of the raster back end: shaders/lib/raster_texels.glsl, seen by the
// host.
#pragma once

#include <cstdint>

#include "engine/core/math.h"

namespace halflight::rays {

/// There are blocks enough to fill the rows; those at the end are empty.
struct RasterLayout {
    static constexpr int kTileEdge = 8;  // texels
    static constexpr std::uint32_t kTileRays = 64;
    static constexpr std::uint32_t kBlockTiles = 64;

    std::uint32_t blocks;
    std::uint32_t columns;  // of blocks
    ivec2 tile_texels;      // size of targets with a texel per tile

    explicit RasterLayout(std::uint32_t capacity);
    std::uint32_t tiles() const { return blocks * kBlockTiles; }
    ivec2 ray_texels() const { return kTileEdge * tile_texels; }
    /// Throws Error where the driver's points or targets are too small.
    void check_driver() const;
};

}  // namespace halflight::rays
