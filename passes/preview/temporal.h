// Reprojected temporal accumulation: the light of the new picture with that of an earlier one at the same places
// (Schied et al. 2017, Spatiotemporal Variance-Guided Filtering, section 4.1).
//
// What is reprojected is light over albedo, at a place of a surface: where the earlier picture's texels around it show
// another surface (another plane, another normal) nothing is known of it, as behind an edge that has moved. What is
// known is clipped to what the new picture's surroundings make likely (variance clipping: Salvi 2016) and weighs as
// much as the samples that it is the mean of, kMostHistory at most, which is the inverse of its variance. It fades out
// as the new picture's own samples become more, and is gone from kTemporalEnds on (shaders/shared/preview.h).
#pragma once

#include <optional>

#include "passes/preview/preview_texels.h"

namespace halflight {

/// An earlier picture as the new one knows it.
struct EarlierPicture {
    PreviewTexels texels;         // of its size, accumulated
    graph::TextureHandle before;  // RGBA32F, size of the new picture; xyz: where what a pixel sees was then, relative
                                  // to the earlier picture's origin. Empty: nothing but the camera has moved
    mat4 to_clip{1};              // from that origin to clip space, +y down, pixels' centres unmoved
    vec3 origin_shift{0};         // of the new picture's origin from the earlier one's, world units
    float pixel = 0;              // > 0, world units that one of its pixels is high where clip space's w is 1
    float share = 1;  // of its samples that count, (0,1]; less than 1 where its pixels are larger than the new one's
};

/// Fills `to`, textures of the new picture's size, and returns their next versions; light and samples are those of the
/// new picture where there is no earlier one or it knows nothing. `refused`: kRefusedKinds uints that outlive the graph
/// and are counted up for every reading of a texel of the earlier picture that was not finite, none of which gets in.
PreviewTexels add_temporal(graph::Graph& graph, const PreviewTexels& now, const std::optional<EarlierPicture>& earlier,
                           const PreviewTexels& to, gpu::Buffer& refused);

}  // namespace halflight
