// Texel pools and texture descriptors (shaders/shared/texture.h).
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "engine/tables/shading_tables.h"

namespace halflight {

/// Allocator of images in the texel pools of `tables`, when they are first referred to. Every pair of image and use is
/// stored once, and so is every descriptor.
class TexturePools {
  public:
    TexturePools(const Scene& scene, ShadingTables& tables) : scene_(scene), tables_(tables) {}

    /// Returns the index of a descriptor of a colour, decoded from sRGB. Throws Error where the pool would exceed 2^31
    /// texels.
    std::uint32_t color(const TextureRef& texture) { return add(texture, true); }
    /// Returns the index of a descriptor of data, with the same limit.
    std::uint32_t data(const TextureRef& texture) { return add(texture, false); }
    /// Fills the pools. Call it after all calls of color() and data().
    void fill();

  private:
    std::uint32_t add(const TextureRef& texture, bool is_color);
    std::uint32_t first_texel(int image, bool is_color);

    const Scene& scene_;
    ShadingTables& tables_;
    std::map<std::pair<int, bool>, std::uint32_t> first_texels_;
    std::size_t color_texels_ = 0;
    std::size_t data_texels_ = 0;
    std::map<std::pair<std::string, bool>, std::uint32_t>
        descriptors_;  // index by the bytes of a descriptor and whether the texture is a colour
};

}  // namespace halflight
