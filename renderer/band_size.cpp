#include "renderer/band_size.h"

#include <algorithm>
#include <bit>

#include "engine/core/error.h"
#include "engine/settings/denoiser_windows.h"
#include "passes/surface/raster_window.h"

namespace halflight {

void check_denoiser_windows(const RenderSettings& s, int texture_size) {
    if (!has_halves(s)) return;
    for (const DenoiserWindow& w :
         denoiser_windows(s.camera.optics, {s.width, s.height}, rendered_window(s, s.camera.optics)))
        if (const int wide = w.size.x + 2 * w.margin; w.margin > 0 && wide > texture_size)
            throw Error("render settings",
                        "{} pixels wide, as a panorama is denoised with its margins: the driver allows {} (--crop "
                        "renders parts)",
                        wide, texture_size);
}

Band first_band(const RenderSettings& s, std::size_t paths, int texture_size) {
    const PixelWindow window = rendered_window(s, s.camera.optics);
    const ivec2 image = window.size(), whole(s.width, s.height);
    const std::size_t row_paths = (static_cast<std::size_t>(image.x) + 15) / 16 * 256;  // paths in a row of blocks
    const int widest = std::max(image.x, s.width);  // rasterizers draw the whole width
    if (widest > texture_size)
        throw Error("render settings", "{} pixels wide: the driver allows {}", widest, texture_size);
    const int most =
        std::min(static_cast<int>(std::max<std::size_t>(paths / row_paths, 1)) * 16, texture_size / 16 * 16);
    Band band{.image = image, .origin = window.first, .display = whole};
    const int stride = window_stride(whole);
    if (stride < s.height) {
        band.rows = std::min(static_cast<int>(std::bit_floor(static_cast<unsigned>(most))), stride);
        while (window.first.y % band.rows != 0) band.rows /= 2;  // no band reaches across raster windows
        return band;
    }
    const int bands = (image.y + most - 1) / most;
    const int rows = ((image.y + bands - 1) / bands + 15) / 16 * 16;
    band.rows = std::min(rows, image.y);
    return band;
}

}  // namespace halflight
