// Primary visibility by rasterization, and the surfaces that it sees.
#pragma once

#include "passes/scene_view.h"

namespace halflight {

/// In path order (shaders/shared/pixel_order.h) except for the two textures.
struct GBuffer {
    graph::TextureHandle visibility;  // RG32UI, size of the raster window: triangle + 1 (0: nothing), block instance
    graph::TextureHandle depth;       // D32F, the same size, reversed, infinite far plane
    graph::BufferHandle rays;         // Ray: the camera ray through the sample point, unit direction
    graph::BufferHandle hits;         // Hit
    graph::BufferHandle surfaces;     // SurfaceRecord: normals, position, material parameters, emission
};

/// What is wanted of it; the others' handles stay empty.
struct GBufferOutputs {
    bool rays = true;
    bool hits = true;
};

/// Rasterizes the band once, jittered as the frame constants say, and evaluates material and geometry at every pixel
/// (a visibility buffer: Burns and Hunt 2013). Where nothing is seen, the record's emission is the environment's
/// radiance.
///
/// Rasterizers snap corners to 1/256 pixel, so that near edges some pixels show a neighbouring triangle. What a pixel's
/// ray hits is therefore sought, by the tracers' own test, among what it and the four pixels beside it show: walls of
/// 10^-4 m are tight (tests/stiff). Of the atrium one pixel in 2100 still tells another triangle than the oracle at
/// 320x240 (one in 900 without the search), half of them one that lies in the same place; the mean of its direct light
/// is within 0.002 %. What is smaller than a pixel is found no better than before: one in 108 at 32x24, the mean 0.1 %
/// low.
///
/// Each pixel is the same, bit for bit, whatever band it is in (passes/raster_window.h).
GBuffer add_gbuffer(graph::Graph& graph, const SceneView& view, const GBufferOutputs& outputs = {});

}  // namespace halflight
