// What a reference is of, as a number: its file in the cache is found by it.
#pragma once

#include <cstdint>
#include <string_view>

#include "tools/measure/converge/painter.h"

namespace halflight::converge {

/// Of all that decides the radiance of the scene's surfaces: geometry, materials, textures, lights, environment. Names
/// and reports are not part of it.
std::uint64_t scene_fingerprint(const Scene& scene);

/// Of the expected picture: scene, size, camera, bounces and pixel filter, and who makes it: the values of `probe`, a
/// small picture that the maker has made of the scene, change where its code changes what it makes.
std::uint64_t reference_fingerprint(std::uint64_t scene, const View& view, std::string_view maker,
                                    const Picture& probe);

}  // namespace halflight::converge
