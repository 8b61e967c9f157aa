#include "engine/core/image.h"

#include <cassert>
#include <cmath>

namespace halflight {

Image::Image(int w, int h, int c) : width(w), height(h), channels(c) {
    assert(w >= 0 && h >= 0 && c >= 1);
    pixels.resize(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) * static_cast<std::size_t>(c));
}

NonFinite count_non_finite(const Image& image) {
    NonFinite count;
    for (float v : image.pixels) {
        count.nans += std::isnan(v);
        count.infinities += std::isinf(v);
    }
    return count;
}

}  // namespace halflight
