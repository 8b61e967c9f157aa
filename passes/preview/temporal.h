// Reprojected temporal accumulation: combines the light of the new picture with that of an earlier one (Schied et al.
// 2017, Spatiotemporal Variance-Guided Filtering, section 4.1).
//
// Light over albedo is reprojected by surface position. Texels of the earlier picture that show another surface
// (another plane or normal) are rejected, as behind a moved edge. The history is clipped to the range that the
// neighbourhood in the new picture makes likely (variance clipping: Salvi 2016). Its weight is its number of samples,
// at most kMostHistory, which is the inverse of its variance. It fades out as the new picture gets samples of its own,
// and has no weight from kTemporalEnds samples on (shaders/shared/preview_constants.h).
#pragma once

#include <optional>

#include "passes/steps/halves.h"

namespace halflight {

/// An earlier picture and its relation to the new one.
struct EarlierPicture {
    PreviewTexels texels;         // accumulated texels, in the picture's own size
    graph::TextureHandle before;  // RGBA32F, size of the new picture; xyz: earlier position of the surface at a pixel,
                                  // relative to the earlier picture's origin. Empty: only the camera has moved
    mat4 to_clip{1};              // matrix from the earlier origin to clip space, +y down, without jitter
    vec3 origin_shift{0};         // new picture's origin minus earlier origin, world units
    float pixel = 0;              // height of an earlier pixel where clip space's w is 1, world units, > 0
    float share = 1;              // weight of the earlier samples, (0,1]; < 1 where earlier pixels are larger
};

/// Fills `to`, textures of the new picture's size, and returns their next versions. Halves are accumulated apart. Where
/// there is no valid history, light and samples are those of the new picture. `refused` are kRefusedKinds uints that
/// outlive the graph. They count the reads of earlier texels that are not finite, which are ignored.
PreviewTexels add_temporal(graph::Graph& graph, const PreviewTexels& now, const std::optional<EarlierPicture>& earlier,
                           const PreviewTexels& to, gpu::Buffer& refused);

}  // namespace halflight
