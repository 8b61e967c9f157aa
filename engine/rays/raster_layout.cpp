#include "engine/rays/raster_layout.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/core/error.h"

namespace halflight::rays {

RasterLayout::RasterLayout(std::uint32_t capacity) {
    const std::uint32_t needed = std::max((capacity + kTileRays * kBlockTiles - 1) / (kTileRays * kBlockTiles), 1u);
    columns = static_cast<std::uint32_t>(std::ceil(std::sqrt(static_cast<double>(needed))));
    const std::uint32_t rows = (needed + columns - 1) / columns;
    blocks = columns * rows;
    tile_texels = kTileEdge * ivec2(columns, rows);
}

void RasterLayout::check_driver() const {
    std::array<GLfloat, 2> points{};
    GLint largest = 0;
    glGetFloatv(GL_POINT_SIZE_RANGE, points.data());
    glGetIntegerv(GL_MAX_FRAMEBUFFER_WIDTH, &largest);
    const ivec2 texels = ray_texels();
    if (points[1] < kTileEdge) throw Error("raster culling", "the driver draws points of at most {} texels", points[1]);
    if (std::max(texels.x, texels.y) > largest) {
        throw Error("raster culling", "a batch of {} x {} texels; the driver draws to at most {}", texels.x, texels.y,
                    largest);
    }
}

}  // namespace halflight::rays
