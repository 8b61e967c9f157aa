#include "engine/settings/data_window.h"

#include <algorithm>
#include <cmath>

#include "engine/settings/denoiser_windows.h"
#include "engine/settings/render_settings.h"

namespace halflight {
namespace {

constexpr int kBlock = 16;  // pixels, side of the blocks of shaders/shared/pixel_order.h

/// Returns the largest multiple of kBlock that is at most `pixel`.
int block_start(int pixel) {
    const int rest = pixel % kBlock;
    return pixel - (rest < 0 ? rest + kBlock : rest);
}

/// Returns whether the denoiser reaches across a side of an eye's panorama.
bool reaches_around(const Optics& optics, int width, const PixelWindow& window) {
    if (optics.projection != Projection::panorama) return false;
    const double columns = width / eyes_in_picture(optics).x;
    return std::floor((window.first.x - kDenoiserReach) / columns) !=
           std::floor((window.end.x + kDenoiserReach - 1) / columns);
}

/// Returns the end of the blocks up to the pixel before `end`, for a picture of `size` pixels.
int block_end(int end, int size) {
    const int blocks = block_start(end + kBlock - 1);
    return end <= size ? std::min(blocks, size) : blocks;
}

}  // namespace

PixelWindow data_window(const PictureSettings& s) {
    const PixelWindow whole{{0, 0}, {s.width, s.height}};
    const PixelWindow inner = s.crop.value_or(whole);
    return {inner.first - s.overscan, inner.end + s.overscan};
}

bool has_window(const PictureSettings& s) {
    return data_window(s) != PixelWindow{{0, 0}, {s.width, s.height}};
}

bool has_overscan(const PictureSettings& s) {
    const PixelWindow window = data_window(s);
    return window.first.x < 0 || window.first.y < 0 || window.end.x > s.width || window.end.y > s.height;
}

PixelWindow rendered_window(const PictureSettings& s, const Optics& optics) {
    PixelWindow window = data_window(s);
    const int reach = has_halves(s) ? kDenoiserReach : s.preview.filter ? kPreviewReach : 0;
    if (reach > 0 && has_window(s)) {
        // There is nothing to see beyond the edges of the picture unless there is overscan.
        const ivec2 size(s.width, s.height);
        if (s.denoise && reaches_around(optics, s.width, window))
            window.first.x = std::min(window.first.x, 0), window.end.x = std::max(window.end.x, size.x);
        window.first = glm::min(window.first, glm::max(window.first - reach, ivec2(0)));
        window.end = glm::max(window.end, glm::min(window.end + reach, size));
    }
    return {{block_start(window.first.x), block_start(window.first.y)},
            {block_end(window.end.x, s.width), block_end(window.end.y, s.height)}};
}

}  // namespace halflight
