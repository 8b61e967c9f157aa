// Variance-guided filtering: the edge-avoiding a-trous wavelet transform (Dammertz et al. 2010) with the edge-stopping
// functions of Schied et al. 2017 (SVGF).
//
// Light over albedo is averaged with that of neighbours on the same surface as far as their difference is explained by
// noise: with the pixel's standard error the reach of the filter falls, so that the picture tends to the mean. Single
// pixels that stand out even then are taken down, or up, to what is around them. Light is lost where few samples hold
// much of it: 6 % of pictures of one sample, of the scenes room and atrium (tests/pass/test_preview_picture.cpp).
#pragma once

#include "passes/preview/preview_texels.h"

namespace halflight {

inline constexpr int kDenoiseLevels = 5;  // taps 1, 2, 4, 8, 16 pixels apart: a reach of 31 pixels

/// RGBA32F of the picture's size: light as PreviewTexels::light has it, filtered; a: variance of its luminance, as it
/// is estimated. frame_constants: struct Frame of the whole picture (shaders/shared/frame.h), for its camera and size.
graph::TextureHandle add_denoise(graph::Graph& graph, const PreviewTexels& texels, graph::BufferHandle frame_constants);

}  // namespace halflight
