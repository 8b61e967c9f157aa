// FLIP: the difference that a viewer notices when an image alternates with its reference, by pixel from 0 to 1.
// Andersson, Nilsson, Akenine-Moller, Oskarsson, Astrom, Fairchild 2020, FLIP: A Difference Evaluator for Alternating
// Images; Andersson, Nilsson, Shirley, Akenine-Moller 2021, Visualizing Errors in Rendered High Dynamic Range Images.
#pragma once

#include "engine/core/image.h"

namespace halflight {

/// Pixels per degree of the visual field, 0.7 m in front of a 0.7 m wide display of 3840 pixels (the papers' default).
inline constexpr double kPixelsPerDegree = 67;

/// Returns LDR-FLIP of linear Rec.709 (a display's decoded sRGB signal), one channel. Values are clamped to [0, 1], NaN
/// counts as 0. Images have 1 (grey), 3 or 4 channels; alpha is ignored. Precondition: same size, ppd > 0.
Image flip_map(const Image& image, const Image& reference, double pixels_per_degree = kPixelsPerDegree);

/// Exposures of HDR-FLIP in stops, about a stop apart. At the first one the tone curve maps the reference's largest
/// luminance to 0.85, at the last one the median (2021, section 3).
struct ExposureRange {
    double first = 0;
    double last = 0;  // last exposure, >= first
    int count = 2;    // >= 2
};
/// Returns the exposures for a reference. A median of 0 counts as 2^-23 of the largest luminance, the resolution of
/// float32 beside it. The exposures of a black reference are 0.
ExposureRange flip_exposures(const Image& reference);

/// Returns HDR-FLIP of scene-linear Rec.709: the largest of the LDR-FLIPs after exposure and the ACES curve (Narkowicz'
/// fit without its exposure, as in the paper). Negative values and NaN count as 0.
Image hdr_flip_map(const Image& image, const Image& reference, double pixels_per_degree = kPixelsPerDegree);

}  // namespace halflight
