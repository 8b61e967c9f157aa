// Sizes of bands, the rows of a picture that are rendered at once.
#pragma once

#include <cstddef>

#include "engine/device/scene_view.h"
#include "renderer/render.h"

namespace halflight {

/// Returns the largest number of paths of a band whose batches and records fit into the driver's buffers and
/// dispatches. Each path has `rays` > 0 rays per batch and `bytes` of records.
std::size_t most_paths_of_batch(const rays::Tracer& tracer, rays::RayKind kind, std::uint32_t rays, std::size_t bytes,
                                const gpu::Limits& limits);

/// Divides a picture into bands of whole block rows and returns the first band. There are as few bands as the driver's
/// limits on buffers and textures allow. All bands have the same size, since each costs as much as the largest.
/// most_paths: an additional limit on the paths of a band. Throws Error for pictures wider than a texture, also with
/// the margins of the denoiser.
Band first_band(const RenderSettings& settings, const SceneBuffers& scene, std::size_t most_paths,
                const gpu::Limits& limits);
/// Returns the first band for explicit limits: paths of a band, and texels along an edge of a texture.
Band first_band(const RenderSettings& settings, std::size_t most_paths, int texture_size);

}  // namespace halflight
