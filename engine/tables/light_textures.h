// Mean luminance of an emission texture over a triangle.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/scene/scene.h"
#include "engine/scene/srgb.h"

namespace halflight {

/// Sums of an image's linear luminance over rectangles of texels.
class LuminanceSums {
  public:
    explicit LuminanceSums(const TextureImage& image);

    /// Returns the mean over a bounding box of all texels that lookups within the triangle can touch. `uvs` are its
    /// corners before the texture's transform. The mean is exactly 0 only if all these texels are black.
    double mean(const TextureRef& texture, const std::array<vec2, 3>& uvs) const;

  private:
    std::uint64_t sum(ivec2 lower, ivec2 upper) const;

    ivec2 size_;
    std::vector<std::uint64_t> sums_;  // (width + 1) x (height + 1) sums of ceil(luminance 2^20), exact
};

}  // namespace halflight
