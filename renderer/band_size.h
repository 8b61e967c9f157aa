// What is rendered at once.
#pragma once

#include <cstddef>

#include "engine/device/scene_view.h"
#include "renderer/render.h"

namespace halflight {

/// The most paths that a band may have, so that a batch of `rays` > 0 of each, and records of `bytes` of each, fit into
/// the driver's buffers and dispatches.
std::size_t most_paths_of_batch(const rays::Tracer& tracer, rays::RayKind kind, std::uint32_t rays, std::size_t bytes,
                                const gpu::Limits& limits);

/// Bands of whole block rows, as few as the driver's limits on buffers and textures allow, and all alike: each costs as
/// much as the largest. Returns the first one. most_paths: that others than the settings and the driver allow. Throws
/// Error for pictures wider than a texture.
Band first_band(const RenderSettings& settings, const SceneBuffers& scene, std::size_t most_paths,
                const gpu::Limits& limits);
/// The same of limits as numbers: of paths in a band, and of texels along an edge of a texture.
Band first_band(const RenderSettings& settings, std::size_t most_paths, int texture_size);

}  // namespace halflight
