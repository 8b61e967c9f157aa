// What preview passes look at, and what becomes of it: from sums to texels of the whole picture, and back to a picture.
#pragma once

#include "passes/picture/accumulate.h"

namespace halflight {

/// RGBA32F, a texel for each pixel of the whole picture. Where no surface is seen, or its light is not finite, light.a
/// is -1 and the rest 0.
struct PreviewTexels {
    // rgb: light that the surface reflects, over its albedo (kLeastAlbedo at least); a: mean square of the luminance
    // of that of single samples.
    graph::TextureHandle light;
    graph::TextureHandle guide;  // xyz: unit shading normal; w: depth along the camera's axis, world units, > 0
    graph::TextureHandle
        place;  // xyz: world, relative to TraceTables::origin; w: samples that the light is the mean of
};

struct PreviewPixels {
    PreviewTexels texels;
    graph::TextureHandle albedo;  // RGBA32F, as light was divided by
    graph::TextureHandle beauty;  // RGBA32F: the mean
};

/// Fills the rows of a band. sums: with squares and features; records: of add_aov(), through the pixels' centres;
/// beauty: of the band, of so many samples; to: of the whole picture. Returns the next versions.
PreviewPixels add_preview_input(graph::Graph& graph, const Band& band, const Accumulated& sums,
                                graph::BufferHandle records, graph::TextureHandle beauty, int samples,
                                const PreviewPixels& to);

/// The picture, RGBA32F: the mean with its reflected light replaced by `accumulated` (as PreviewTexels::light) and, as
/// far as the pixel's samples are few (kFilterWeakens, kFilterEnds), by `filtered`, which may be empty. Where the light
/// is as it was, the mean stays, bit for bit; so it does where the new one would not be finite.
graph::TextureHandle add_preview_output(graph::Graph& graph, const PreviewPixels& from,
                                        graph::TextureHandle accumulated, graph::TextureHandle filtered);

}  // namespace halflight
