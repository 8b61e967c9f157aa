// Pictures with their components, and sums of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/core/image.h"

namespace halflight::converge {

/// Names of the components, as in the AOVs. The sum of all components is the beauty.
inline constexpr std::array kComponents{"emission", "direct_diffuse", "direct_glossy", "indirect_diffuse",
                                        "indirect_glossy"};

/// Mean radiance; all images have 3 channels and the same size.
struct Picture {
    Image beauty;
    std::array<Image, kComponents.size()> components;  // images of kComponents; empty if not known
    int samples = 0;                                   // samples per pixel
    std::uint64_t non_finite = 0;  // number of values replaced by zero or left out, which a renderer should not produce

    bool has_components() const { return !components[0].pixels.empty(); }
};

/// Sums of pictures weighted by their samples, in double.
class PictureSums {
  public:
    PictureSums() = default;
    PictureSums(int width, int height);

    /// Adds a picture of the same size.
    void add(const Picture& picture);
    void add(const PictureSums& other);
    Picture mean() const;  ///< Returns the mean; black without samples.

    int width = 0;
    int height = 0;
    std::int64_t samples = 0;
    std::array<std::vector<double>, kComponents.size()> sums;  // three sums per pixel and component
};

}  // namespace halflight::converge
