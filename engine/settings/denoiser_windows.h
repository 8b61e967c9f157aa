// The parts of a picture that are denoised apart from each other: pictures of eyes, and panoramas as rings.
#pragma once

#include <vector>

#include "engine/core/optics.h"
#include "engine/settings/data_window.h"

namespace halflight {

/// Pixels around a window that the denoiser needs for the picture that it makes of the whole. Fireflies are found (8).
/// Then they are spread twice (44), or light is filtered by means (12), small means (7), what is kept (12), wide means (13
/// and 23) and a share (14): 89 together.
inline constexpr int kDenoiserReach = 96;
/// The same for the filter of previews, which finds and spreads fireflies in the same way, and whose three filters
/// reach 5, 7 and 11 pixels: 75 together.
inline constexpr int kPreviewReach = 80;

/// A part of a picture that is denoised as if it were the whole.
struct DenoiserWindow {
    ivec2 first{0};  // upper left pixel, from that of the rendered pixels
    ivec2 size{0};   // pixels, > 0
    int margin = 0;  // columns that are added on either side: copies of those at the other side; at most size.x
    bool operator==(const DenoiserWindow&) const = default;
};

/// Returns the parts of the rendered pixels (rendered_window()), one for each eye that they show. whole: size of the
/// whole picture, pixels.
std::vector<DenoiserWindow> denoiser_windows(const Optics& optics, const ivec2& whole, const PixelWindow& rendered);

}  // namespace halflight
