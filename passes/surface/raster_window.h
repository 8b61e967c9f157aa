// The rows of a picture that the rasterizer sees at once.
#pragma once

#include "engine/device/scene_view.h"

namespace halflight {

/// Rasterizers round a corner's place on its target, and clip to it. So that a pixel is drawn with the same bits
/// whichever band asks for it, targets are as high as the picture and bands are cut out of it (scissors); of pictures
/// too large for that, windows of their own, with a row beyond either end for those who ask what lies beside a pixel.
struct RasterWindow {
    int y = 0;     // first row, of the picture
    int rows = 0;  // some may lie below the picture
};

/// No band may reach from one window to the next: its first row is a multiple of its rows, and these divide this
/// number, or are all of the picture. A power of two, or the picture's height.
int window_stride(const ivec2& image);

/// That holds the band, and a row above and below it where the picture has these. rows: those of every window.
RasterWindow raster_window(const Band& band);

}  // namespace halflight
