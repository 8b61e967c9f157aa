// Images in memory.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace halflight {

/// Float image: row-major, top row first, channels interleaved. Values are scene-linear unless its user says otherwise.
struct Image {
    int width = 0;     // pixels, >= 0
    int height = 0;    // pixels, >= 0
    int channels = 0;  // channels per pixel, >= 1
    std::vector<float> pixels;

    Image() = default;
    Image(int width, int height, int channels);

    float* at(int x, int y) { return pixels.data() + offset(x, y); }
    const float* at(int x, int y) const { return pixels.data() + offset(x, y); }

  private:
    std::size_t offset(int x, int y) const {
        return (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) *
               static_cast<std::size_t>(channels);
    }
};

/// Counts of NaNs and infinities in an image. Either is a bug in an image that a pass writes.
struct NonFinite {
    std::size_t nans = 0;
    std::size_t infinities = 0;
};
NonFinite count_non_finite(const Image& image);

}  // namespace halflight
