// Fingerprints, by which files of references are found in the cache.
#pragma once

#include <cstdint>
#include <string_view>

#include "tools/measure/converge/painter.h"

namespace halflight::converge {

/// Returns a hash of everything that determines the radiance of the scene's surfaces: geometry, materials, textures,
/// lights, environment. Names and reports do not count.
std::uint64_t scene_fingerprint(const Scene& scene);

/// Returns a hash of everything that determines the expected picture: scene, size, camera, bounces, pixel filter and
/// renderer. `probe` is a small picture by this renderer, whose values change with its code.
std::uint64_t reference_fingerprint(std::uint64_t scene, const View& view, std::string_view maker,
                                    const Picture& probe);

}  // namespace halflight::converge
