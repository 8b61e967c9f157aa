// Inputs and outputs of the preview filters: conversion of sums to texels of the whole picture, and of filtered texels
// to a picture.
#pragma once

#include "passes/picture/accumulate.h"

namespace halflight {

/// RGBA32F textures with a texel for each pixel of the whole picture. Where no surface is visible, or its light is not
/// finite, light.a is -1 and all else is 0.
struct PreviewTexels {
    // rgb: reflected light over albedo (at least kLeastAlbedo); a: mean square of this quantity's luminance over single
    // samples.
    graph::TextureHandle light;
    graph::TextureHandle guide;  // xyz: unit shading normal; w: depth along the camera's axis, world units, > 0
    graph::TextureHandle
        place;  // xyz: world, relative to TraceTables::origin; w: samples that the light is the mean of
};

struct PreviewPixels {
    PreviewTexels texels;
    graph::TextureHandle albedo;  // RGBA32F: albedo by which `light` was divided
    graph::TextureHandle beauty;  // RGBA32F: mean of the picture
};

/// Fills the rows of a band and returns the next versions of `to`, textures of the whole picture. `sums` has squares
/// and features, `records` are those of add_aov(), and `beauty` is the band's mean over `samples` samples.
PreviewPixels add_preview_input(graph::Graph& graph, const Band& band, const Accumulated& sums,
                                graph::BufferHandle records, graph::TextureHandle beauty, int samples,
                                const PreviewPixels& to);

/// Returns the picture, RGBA32F: the mean with its reflected light replaced by `accumulated` (as PreviewTexels::light).
/// Pixels with few samples (kFilterWeakens, kFilterEnds) are blended towards `filtered`, which may be empty. The mean
/// is kept, bit for bit, where the light is unchanged and where the new light is not finite.
graph::TextureHandle add_preview_output(graph::Graph& graph, const PreviewPixels& from,
                                        graph::TextureHandle accumulated, graph::TextureHandle filtered);

}  // namespace halflight
