// A pair of triangles as kernels read it (shaders/shared/bvh_nodes.h). No OpenGL is used.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include "engine/core/math.h"
#include "engine/rays/pairs.h"
#include "engine/tables/tables.h"
#include "shaders/shared/bvh_nodes.h"

namespace halflight::rays {

/// A triangle as its pair names it.
struct PairMember {
    std::uint32_t id = 0;    // index into TraceTables::triangles, below kBvhTriangleLimit
    std::uint32_t word = 0;  // flags of tables.h
};

/// Returns the order of a triangle of a pair.
inline std::uint32_t order_in_file(const TrianglePair& pair, int which) {
    const auto corners = corners_in_pair(pair, which);
    const auto place_of = [&](std::uint8_t corner) {
        return static_cast<std::uint32_t>(std::ranges::find(corners, corner) - corners.begin());
    };
    return place_of(1) | place_of(2) << 2;
}

/// Packs a pair. `member_of` returns the PairMember of a triangle of TrianglePair::triangles.
template <class MemberOf>
std::array<vec4, shared::kBvhPairTexels> pair_texels(const Ring& ring, const TrianglePair& pair, MemberOf member_of) {
    std::array<vec4, shared::kBvhPairTexels> texels;
    for (int a = 0; a < 3; ++a) texels[static_cast<std::size_t>(a)] = {ring[0][a], ring[1][a], ring[2][a], ring[3][a]};
    uvec3 words(shared::kBvhTag);
    for (int which = 0; which < 2; ++which) {
        const PairMember member = member_of(pair.triangles[static_cast<std::size_t>(which)]);
        words[which] |= member.id;
        std::uint32_t flags = 0;
        if (member.word & kTriangleAlpha) flags |= shared::kBvhAlphaTested;
        if (member.word & kTriangleOneSided) flags |= shared::kBvhOneSided;
        if (member.word & kTriangleMirrored) flags |= shared::kBvhMirrored;
        words.z |= flags << (which * shared::kBvhFlagShift);
        words.z |= order_in_file(pair, which) << (which * shared::kBvhOrderShift);
    }
    texels[3] = {std::bit_cast<float>(words.x), std::bit_cast<float>(words.y), std::bit_cast<float>(words.z), 0};
    return texels;
}

/// Packs a pair of a page. `corners` are below 2^kBvhPageCornerBits. The flags of both triangles differ in
/// kTriangleAlpha only.
template <class MemberOf>
uvec4 page_pair(const std::array<std::uint32_t, 4>& corners, const TrianglePair& pair, MemberOf member_of) {
    uvec4 words;
    for (int which = 0; which < 2; ++which) {
        const PairMember member = member_of(pair.triangles[static_cast<std::size_t>(which)]);
        const auto first = static_cast<std::size_t>(2 * which);
        const std::uint32_t facing = which == 0 ? kTriangleOneSided : kTriangleMirrored;
        words[which] = member.id | ((member.word & kTriangleAlpha) != 0 ? shared::kBvhPageAlpha : 0) |
                       ((member.word & facing) != 0 ? shared::kBvhPageFacing : 0);
        words[2 + which] = corners[first] | (corners[first + 1] << shared::kBvhPageCornerBits) |
                           (order_in_file(pair, which) << shared::kBvhPageOrderShift);
    }
    return words;
}

}  // namespace halflight::rays
