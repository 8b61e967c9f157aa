// Primary visibility, rasterized or traced, and the surface records of visible points.
#pragma once

#include <vector>

#include "engine/settings/visibility.h"
#include "passes/steps/surfaces.h"

namespace halflight {

/// Optional outputs of rasterized visibility; other handles stay empty. Traced visibility always has rays and hits.
struct GBufferOutputs {
    bool rays = true;
    bool hits = true;
};

/// Finds the hit of every pixel's camera ray, with the jitter of the frame constants, and resolves it to a surface
/// record (a visibility buffer: Burns and Hunt 2013). Where nothing is hit, the record's emission is the environment's
/// radiance. `primary` must not be `automatic`.
///
/// If traced, camera rays are a batch of kind primary and depth 0, and hits are exact.
///
/// Rasterizers snap corners to 1/256 pixel, so that some pixels near edges show a neighbouring triangle. The hit is
/// therefore searched, by the tracers' own test, among the triangles of the pixel and its four neighbours: walls of
/// 10^-4 m are tight (tests/stiff). In the atrium at 320x240, one pixel in 2100 still differs from the oracle's
/// triangle, half of them in a triangle at the same place. Without the search it is one in 900. The mean of the direct
/// light is within 0.002 %. Triangles smaller than a pixel do not profit: one pixel in 108 differs at 32x24, and the
/// mean is 0.1 % low.
///
/// Camera rays that start on a lens (SceneView::lens), and those beyond the edges of the whole picture, must be traced.
///
/// The bits of a pixel do not depend on its band (passes/surface/raster_window.h).
GBuffer add_gbuffer(graph::Graph& graph, const SceneView& view, const GBufferOutputs& outputs = {},
                    PrimaryVisibility primary = PrimaryVisibility::raster);

/// Returns the mean emission seen through several points of each pixel, one for each entry of `frame_constants`. It is
/// the radiance of surfaces, or of the environment where there is none, and with `lamps` that of the lamps in front
/// (passes/steps/lamps.h). The result has a vec4 per path, w 0. The constants may differ in jitter, sample_index and
/// seed only.
graph::BufferHandle add_seen(graph::Graph& graph, const SceneView& view,
                             const std::vector<graph::BufferHandle>& frame_constants, PrimaryVisibility primary,
                             bool lamps = false);

}  // namespace halflight
