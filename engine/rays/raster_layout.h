// Positions of a batch's rays in the render targets of raster culling. This is the host's version of
// shaders/lib/raster_texels.glsl.
#pragma once

#include <cstdint>

#include "engine/core/math.h"

namespace halflight::rays {

/// Numbers of blocks and texels. Blocks are rounded up to full rows; those at the end are empty.
struct RasterLayout {
    static constexpr int kTileEdge = 8;  // texels along a tile's edge
    static constexpr std::uint32_t kTileRays = 64;
    static constexpr std::uint32_t kBlockTiles = 64;

    std::uint32_t blocks;
    std::uint32_t columns;  // blocks per row
    ivec2 tile_texels;      // size in texels of targets with one texel per tile

    explicit RasterLayout(std::uint32_t capacity);
    std::uint32_t tiles() const { return blocks * kBlockTiles; }
    ivec2 ray_texels() const { return kTileEdge * tile_texels; }
    /// Throws Error if the driver's points or targets are too small.
    void check_driver() const;
};

}  // namespace halflight::rays
