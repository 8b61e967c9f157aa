#include "passes/surface/raster_window.h"

#include <algorithm>
#include <bit>

namespace halflight {
namespace {

constexpr int kMostRows = 16384;                           // rows; guaranteed texture size (OpenGL 4.5, table 23.53)
constexpr std::size_t kMostPixels = std::size_t{1} << 24;  // pixels of 12 bytes, 192 MiB in all

}  // namespace

int window_stride(const ivec2& image) {
    const auto fitting = static_cast<unsigned>(kMostPixels / static_cast<std::size_t>(image.x));
    if (image.y <= kMostRows && static_cast<unsigned>(image.y) <= fitting) return image.y;
    // A row of blocks has 16 rows.
    return static_cast<int>(std::clamp(std::bit_floor(fitting), 16u, unsigned{kMostRows} / 2));
}

RasterWindow raster_window(const Band& band) {
    const ivec2 whole = band.whole();
    const int stride = window_stride(whole);
    if (stride == whole.y) return {0, stride};
    return {std::max((band.origin.y + band.y) / stride * stride - 1, 0), stride + 2};
}

}  // namespace halflight
