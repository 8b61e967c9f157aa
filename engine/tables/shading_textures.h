// Texel pools and texture descriptors (shaders/shared/texture.h).
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "engine/tables/shading_tables.h"

namespace halflight {

/// Gives images a place in the pools of `tables` when they are first referred to; every (image, use) is stored once,
/// and so is every descriptor.
class TexturePools {
  public:
    TexturePools(const Scene& scene, ShadingTables& tables) : scene_(scene), tables_(tables) {}

    /// Index of a descriptor. Colour is decoded from sRGB. Throws Error where a pool would exceed 2^31 texels.
    std::uint32_t color(const TextureRef& texture) { return add(texture, true); }
    std::uint32_t data(const TextureRef& texture) { return add(texture, false); }
    /// Puts the texels there, after all that refers to them.
    void fill();

  private:
    std::uint32_t add(const TextureRef& texture, bool is_color);
    std::uint32_t first_texel(int image, bool is_color);

    const Scene& scene_;
    ShadingTables& tables_;
    std::map<std::pair<int, bool>, std::uint32_t> first_texels_;
    std::size_t color_texels_ = 0;
    std::size_t data_texels_ = 0;
    std::map<std::pair<std::string, bool>, std::uint32_t> descriptors_;  // by the bytes of a descriptor
};

}  // namespace halflight
