// Variance-guided filtering: the edge-avoiding a-trous wavelet transform (Dammertz et al. 2010) with the edge-stopping
// functions of Schied et al. 2017 (SVGF).
//
// Light over albedo is averaged with that of neighbours on the same surface, as far as noise explains their difference.
// The reach of the filter shrinks with the pixel's standard error, so that the picture converges to the mean. Single
// outliers are then clamped to the range of their neighbours. Light is lost where few samples hold much of it: 6 % with
// one sample in the scenes room and atrium (tests/pass/picture/test_preview_picture.cpp).
#pragma once

#include "passes/preview/preview_texels.h"

namespace halflight {

inline constexpr int kDenoiseLevels = 5;  // taps 1, 2, 4, 8, 16 pixels apart: a reach of 31 pixels

/// Returns the filtered light, RGBA32F of the picture's size. rgb: as PreviewTexels::light; a: estimated variance of
/// its luminance. `frame_constants` is struct Frame of the picture (shaders/shared/frame.h), for its camera and size.
graph::TextureHandle add_denoise(graph::Graph& graph, const PreviewTexels& texels, graph::BufferHandle frame_constants);

}  // namespace halflight
