// Small procedural pictures, as the bytes of PNG files. Colours are made and stored sRGB-encoded. All of them tile.
#pragma once

#include <string>

#include "engine/core/math.h"

namespace halflight::scenes {

/// A colour map with the maps that go with it; those that a material does not need are empty.
struct TextureSet {
    std::string color;
    std::string normal;     // tangent space, +Y up (green grows towards v = 0)
    std::string roughness;  // G roughness, B metallic
};

TextureSet marble_tiles();  ///< Makes 2 x 2 polished tiles, light and dark in turn, with grout between.
TextureSet stone_blocks();  ///< Makes a wall of 3 courses of ashlar.
TextureSet limestone();     ///< Makes fine grain without joints.
TextureSet planks();        ///< Makes four boards, their grain along u.
TextureSet checker();       ///< Makes 8 x 8 fields, for reading off distortion.
/// Makes a banner, 1 wide and 2 high: border and sun in `motif` on `cloth` (sRGB).
TextureSet banner(const dvec3& cloth, const dvec3& motif);
TextureSet leaves();  ///< Makes a spray of leaves; alpha is 0 around them.

}  // namespace halflight::scenes
