// The parts of a picture that are denoised apart from each other: pictures of eyes, and panoramas as rings.
#pragma once

#include <vector>

#include "engine/core/optics.h"
#include "engine/settings/data_window.h"

namespace halflight {

/// Pixels around a window that the denoiser needs for the picture that it makes of the whole. Its stages together reach
/// 59 pixels: fireflies are found (8) and spread twice (44), and a pixel sees the noise (2) and means (5).
inline constexpr int kDenoiserReach = 64;
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
