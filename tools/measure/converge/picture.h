// Pictures with their components, and sums of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/core/image.h"

namespace halflight::converge {

/// Named as the AOVs are. Their sum is the beauty.
inline constexpr std::array kComponents{"emission", "direct_diffuse", "direct_glossy", "indirect_diffuse",
                                        "indirect_glossy"};

/// Mean radiance, 3 channels each, of the same size.
struct Picture {
    Image beauty;
    std::array<Image, kComponents.size()> components;  // empty images where they are not known
    int samples = 0;                                   // per pixel
    std::uint64_t non_finite = 0;  // values that were taken as zero or left out: a bug in who made it

    bool has_components() const { return !components[0].pixels.empty(); }
};

/// Pictures by their samples, in double.
class PictureSums {
  public:
    PictureSums() = default;
    PictureSums(int width, int height);

    /// Precondition: of the same size.
    void add(const Picture& picture);
    void add(const PictureSums& other);
    Picture mean() const;  ///< black without samples

    int width = 0;
    int height = 0;
    std::int64_t samples = 0;
    std::array<std::vector<double>, kComponents.size()> sums;  // 3 per pixel
};

}  // namespace halflight::converge
