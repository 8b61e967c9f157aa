// Inputs and outputs of the preview filters: conversion of sums to texels of the whole picture, and of filtered texels
// to a picture.
#pragma once

#include <optional>

#include "passes/steps/halves.h"
#include "passes/steps/sums.h"

namespace halflight {

struct PreviewPixels {
    PreviewTexels texels;
    graph::TextureHandle albedo;  // RGBA32F: albedo by which light was divided
    graph::TextureHandle beauty;  // RGBA32F: mean of the picture
};

/// Number of samples in the sums of a band. Sums of several kinds of samples are weighted.
struct PreviewSamples {
    double all = 0;
    double first = 0;  // number of samples of the first half
};

/// Fills the rows of a band and returns the next versions of `to`, textures of the whole picture. `sums` has features
/// and halves, `records` are those of add_aov() if `to` has places, and `beauty` is the band's mean.
PreviewPixels add_preview_input(graph::Graph& graph, const Band& band, const Accumulated& sums,
                                graph::BufferHandle records, graph::TextureHandle beauty, const PreviewSamples& samples,
                                const PreviewPixels& to);

/// Returns the halves of the light as the filter expects them. If all samples are in one half, neighbours serve as
/// the other one. albedo: that of PreviewPixels.
LightHalves add_preview_halves(graph::Graph& graph, const PreviewTexels& texels, graph::TextureHandle albedo);

/// Returns the picture, RGBA32F: the mean with its reflected light replaced by that of `accumulated`. Pixels with few
/// samples (kFilterWeakens, kFilterEnds) are blended towards `filtered`. The mean is kept, bit for bit, where the light
/// is unchanged and where the new light is not finite.
graph::TextureHandle add_preview_output(graph::Graph& graph, const PreviewPixels& from,
                                        const PreviewTexels& accumulated,
                                        const std::optional<FilteredHalves>& filtered);

}  // namespace halflight
