// Mip levels of images, for lookups by ray footprint (docs/textures.md).
#pragma once

#include "engine/scene/material.h"

namespace halflight {

/// Uses of an image in lookups that choose a level.
struct LevelUses {
    bool color = false;
    bool data = false;
    bool normal = false;  // some data lookup reads normals, so its levels are averages of normals
    LevelUses& operator|=(const LevelUses& other);
    bool operator==(const LevelUses&) const = default;
};

/// Returns the number of levels of an image of this size, level 0 included. The last level has one texel.
int level_count(int width, int height);
/// Returns the texels of levels 1 and up of an image of this size.
std::size_t level_texels(int width, int height);

/// Fills TextureImage::color_levels and data_levels from the texels of level 0, which must be in memory. Each level has
/// half the size of the one before it, rounded down. A texel is the mean of the area that it covers there. Colours
/// are averaged as linear values and stored as sRGB. Means of normals are normalised. Each level is rounded to the
/// image's 8 or 16 bits.
void add_levels(TextureImage& image, const LevelUses& uses);

}  // namespace halflight
