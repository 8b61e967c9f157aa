// A pair of triangles as kernels read it (shaders/shared/bvh.h). No OpenGL is used.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include "engine/core/math.h"
#include "engine/rays/pairs.h"
#include "shaders/shared/bvh.h"

namespace halflight::rays {

/// Packs a pair. `id_of` returns the id of a triangle of TrianglePair::triangles: its index in TraceTables::triangles,
/// and kBvhAlphaTested.
template <class IdOf>
std::array<vec4, shared::kBvhPairTexels> pair_texels(const Ring& ring, const TrianglePair& pair, IdOf id_of) {
    std::array<vec4, shared::kBvhPairTexels> texels;
    for (int a = 0; a < 3; ++a) texels[static_cast<std::size_t>(a)] = {ring[0][a], ring[1][a], ring[2][a], ring[3][a]};
    uvec3 words(shared::kBvhTag);
    for (int which = 0; which < 2; ++which) {
        words[which] |= id_of(pair.triangles[static_cast<std::size_t>(which)]);
        const auto corners = corners_in_pair(pair, which);
        const auto place_of = [&](std::uint8_t corner) {
            return static_cast<std::uint32_t>(std::ranges::find(corners, corner) - corners.begin());
        };
        words.z |= (place_of(1) | place_of(2) << 2) << (which * shared::kBvhOrderShift);
    }
    texels[3] = {std::bit_cast<float>(words.x), std::bit_cast<float>(words.y), std::bit_cast<float>(words.z), 0};
    return texels;
}

}  // namespace halflight::rays
