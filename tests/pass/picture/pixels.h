// Pixels of pictures, and errors of pictures against a reference.
#pragma once

#include <vector>

#include "engine/core/image_tools.h"
#include "engine/core/math.h"
#include "engine/core/metrics.h"

namespace halflight::test {

struct Pixel {
    int x = 0, y = 0;
};

/// Returns the pixels of [first, end), row by row.
inline std::vector<Pixel> pixels_of(const ivec2& first, const ivec2& end) {
    std::vector<Pixel> pixels;
    for (int y = first.y; y < end.y; ++y)
        for (int x = first.x; x < end.x; ++x) pixels.push_back({x, y});
    return pixels;
}
inline std::vector<Pixel> pixels_of(const ivec2& size) {
    return pixels_of(ivec2(0), size);
}

/// Returns the relative mean squared error of the colours.
inline double relative_error(const Image& image, const Image& reference) {
    return mean_of(relative_squared_error_map(rgb(image), rgb(reference)));
}

}  // namespace halflight::test
