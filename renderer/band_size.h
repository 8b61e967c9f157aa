// Sizes of bands, the rows of a picture that are rendered at once.
#pragma once

#include <cstddef>

#include "engine/device/scene_view.h"
#include "renderer/render.h"

namespace halflight {

/// Divides a picture into bands of whole block rows and returns the first band. There are as few bands as the limits
/// allow. All bands have the same size, since each costs as much as the largest. most_paths: limit on the paths of a
/// band; a row of blocks may exceed it. texture_size: limit on the texels along an edge of a texture. Throws Error for
/// pictures wider than a texture.
Band first_band(const RenderSettings& settings, std::size_t most_paths, int texture_size);
/// Throws Error for pictures that are wider than a texture with the margins of the denoiser.
void check_denoiser_windows(const RenderSettings& settings, int texture_size);

}  // namespace halflight
