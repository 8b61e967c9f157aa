// The part of a picture that is rendered: crops and overscan.
#pragma once

#include <optional>

#include "engine/core/math.h"
#include "engine/core/optics.h"

namespace halflight {

struct PictureSettings;

/// A rectangle of pixels. (0, 0) is the upper left pixel of the whole picture.
struct PixelWindow {
    ivec2 first{0};  // upper left pixel
    ivec2 end{0};    // pixel after the lower right one
    ivec2 size() const { return end - first; }
    bool operator==(const PixelWindow&) const = default;
};

/// Returns the pixels that a picture has: its crop, or else all of it, grown by the overscan.
PixelWindow data_window(const PictureSettings& settings);
/// Returns whether the settings ask for other pixels than those of the whole picture.
bool has_window(const PictureSettings& settings);
/// Returns whether pixels beyond the edges of the whole picture are asked for.
bool has_overscan(const PictureSettings& settings);
/// Returns the pixels that are rendered for data_window(): whole blocks of 16x16 pixels of the picture's own grid,
/// because the pixels of a block may share their paths. Blocks end at the picture's edge unless the window reaches
/// beyond it. optics: those of the picture's camera.
PixelWindow rendered_window(const PictureSettings& settings, const Optics& optics);

}  // namespace halflight
