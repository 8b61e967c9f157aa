// The G-buffer: results of primary visibility.
#pragma once

#include "engine/device/scene_view.h"

namespace halflight {

/// Results of primary visibility. Buffers are in path order (shaders/shared/pixel_order.h).
struct GBuffer {
    // The textures exist only if visibility is rasterized.
    graph::TextureHandle visibility;  // RG32UI, size of the raster window: triangle + 1 (0: nothing), block instance
    graph::TextureHandle depth;       // D32F, equal size, reversed depth, infinite far plane
    graph::BufferHandle rays;         // one Ray per path: the camera ray through the sample point, unit direction
    graph::BufferHandle hits;         // one Hit per path
    graph::BufferHandle surfaces;  // surface records (shaders/shared/surface_rows.h): position, normals, BSDF, emission
};

}  // namespace halflight
