// What is rendered at once.
#pragma once

#include <cstddef>

#include "passes/render.h"
#include "passes/scene_view.h"

namespace halflight {

/// The most paths that a band may have, so that a batch of so many rays of each fits into the driver's buffers and
/// dispatches. rays_of_path: > 0.
std::size_t most_paths(const rays::Tracer& tracer, rays::RayKind kind, std::uint32_t rays_of_path,
                       const gpu::Limits& limits);

/// Bands of whole block rows, as few as the driver's limits on buffers and textures allow, and all alike: each costs as
/// much as the largest. Returns the first one. most_paths: that others than the settings and the driver allow. Throws
/// Error for pictures wider than a texture.
Band first_band(const RenderSettings& settings, const SceneBuffers& scene, std::size_t most_paths,
                const gpu::Limits& limits);

}  // namespace halflight
