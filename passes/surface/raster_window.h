// The rows of a picture that are rasterized at once.
#pragma once

#include "engine/device/scene_view.h"

namespace halflight {

/// Rows of the render target. Rasterizers round corners relative to the target and clip to it. To give a pixel the same
/// bits in every band, the target is as high as the picture, and bands are cut out by scissors. Pictures too large for
/// that are divided into windows, with an extra row at either end for queries about neighbouring pixels.
struct RasterWindow {
    int y = 0;     // first row, of the picture
    int rows = 0;  // number of rows; some may lie below the picture
};

/// Returns the rows from one window to the next: a power of two, or the picture's height. No band may reach across
/// windows. Its rows divide this number and its first row is a multiple of them, or it is the whole picture. image:
/// size of the whole picture, Band::whole().
int window_stride(const ivec2& image);

/// Returns the window that contains the band, and a row above and below it if the picture has these. All windows of
/// a picture have the same number of rows.
RasterWindow raster_window(const Band& band);

}  // namespace halflight
