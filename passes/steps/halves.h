// Textures of two halves of the samples, which filters of pictures and previews exchange.
#pragma once

#include "engine/graph/graph.h"

namespace halflight {

/// Halves of a component, RGBA32F. rgb: light over albedo; a: share of the samples that are in the first half, 0 where
/// there is nothing to filter. Empty: the picture has no such light.
struct LightHalves {
    graph::TextureHandle first, second;
};

/// Light filtered by the cheap form, see LightHalves. Its mean plus rgb of `spread` is the light over albedo.
struct FilteredHalves {
    graph::TextureHandle first, second;
    graph::TextureHandle spread;  // light of fireflies over albedo
};

/// RGBA32F textures with a texel for each pixel of the whole picture. Where no surface is visible, or its light is not
/// finite, the alpha of both halves is -1 and all else is 0.
struct PreviewTexels {
    // Halves of the samples. rgb: reflected light over albedo (at least kLeastFilteredAlbedo); a: number of samples, >=
    // 0.
    graph::TextureHandle first, second;
    graph::TextureHandle guide;    // xyz: mean of shading normals; w: mean of ln(depth along the camera's axis)
    graph::TextureHandle place{};  // surface at the centre; xyz: world, relative to TraceTables::origin; w: 1, or 0
                                   // where there is none. Empty: nothing is reprojected
};

}  // namespace halflight
