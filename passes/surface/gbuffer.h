// Primary visibility, rasterized or traced, and the surfaces that it sees.
#pragma once

#include <vector>

#include "engine/device/scene_view.h"
#include "engine/settings/visibility.h"

namespace halflight {

/// In path order (shaders/shared/pixel_order.h) except for the two textures.
struct GBuffer {
    // Only of rasterized ones:
    graph::TextureHandle visibility;  // RG32UI, size of the raster window: triangle + 1 (0: nothing), block instance
    graph::TextureHandle depth;       // D32F, the same size, reversed, infinite far plane
    graph::BufferHandle rays;         // Ray: the camera ray through the sample point, unit direction
    graph::BufferHandle hits;         // Hit
    graph::BufferHandle surfaces;     // SurfaceRecord: normals, position, material parameters, emission
};

/// What is wanted of it; the others' handles stay empty, unless it is traced: then rays and hits are its makings.
struct GBufferOutputs {
    bool rays = true;
    bool hits = true;
};

/// Finds what the camera ray of every pixel hits, jittered as the frame constants say, and evaluates material and
/// geometry there (a visibility buffer: Burns and Hunt 2013). Where nothing is seen, the record's emission is the
/// environment's radiance. primary: not `automatic`.
///
/// Traced, camera rays are a batch like any other, of kind primary and depth 0, and hits are exact.
///
/// Rasterizers snap corners to 1/256 pixel, so that near edges some pixels show a neighbouring triangle. What a pixel's
/// ray hits is therefore sought, by the tracers' own test, among what it and the four pixels beside it show: walls of
/// 10^-4 m are tight (tests/stiff). Of the atrium one pixel in 2100 still tells another triangle than the oracle at
/// 320x240 (one in 900 without the search), half of them one that lies in the same place; the mean of its direct light
/// is within 0.002 %. What is smaller than a pixel is found no better than before: one in 108 at 32x24, the mean 0.1 %
/// low.
///
/// Each pixel is the same, bit for bit, whatever band it is in (passes/surface/raster_window.h).
GBuffer add_gbuffer(graph::Graph& graph, const SceneView& view, const GBufferOutputs& outputs = {},
                    PrimaryVisibility primary = PrimaryVisibility::raster);

/// What shines directly through several points of each pixel, of which there are as many as frame constants: the mean
/// of the radiance that surfaces emit there, or the environment where there is none. vec4 by path, w: 0. Nothing but
/// the jitter, sample_index and seed of the constants may differ.
graph::BufferHandle add_seen(graph::Graph& graph, const SceneView& view,
                             const std::vector<graph::BufferHandle>& frame_constants, PrimaryVisibility primary);

}  // namespace halflight
