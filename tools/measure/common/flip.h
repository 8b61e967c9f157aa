// FLIP: what a viewer notices when an image is swapped with its reference, per pixel from 0 (nothing) to 1.
// Andersson, Nilsson, Akenine-Moller, Oskarsson, Astrom, Fairchild 2020, FLIP: A Difference Evaluator for Alternating
// Images; Andersson, Nilsson, Shirley, Akenine-Moller 2021, Visualizing Errors in Rendered High Dynamic Range Images.
#pragma once

#include "engine/core/image.h"

namespace halflight {

/// Pixels per degree of the viewer's sight: 0.7 m in front of a 0.7 m wide display of 3840 pixels (the papers'
/// default).
inline constexpr double kPixelsPerDegree = 67;

/// LDR-FLIP of linear Rec.709 in [0, 1] (a display's sRGB signal, decoded); values outside are clamped, NaN counts as
/// 0. One channel. Images have 1 (grey), 3 or 4 channels, alpha is not looked at; precondition: same size, ppd > 0.
Image flip_map(const Image& image, const Image& reference, double pixels_per_degree = kPixelsPerDegree);

/// Exposures, in stops, that HDR-FLIP looks at: from where the tone curve brings the reference's largest luminance to
/// 0.85, up to where it brings the median there (2021, section 3), about a stop apart.
struct ExposureRange {
    double first = 0;
    double last = 0;  // >= first
    int count = 2;    // >= 2
};
/// A median of 0 counts as 2^-23 of the largest: what float32 still tells apart beside it. A black reference is looked
/// at as it is, at exposure 0.
ExposureRange flip_exposures(const Image& reference);

/// HDR-FLIP of scene-linear Rec.709: the largest of the LDR-FLIPs after exposure and the ACES curve (Narkowicz' fit,
/// without its exposure, as in the paper). Negative values and NaN count as 0.
Image hdr_flip_map(const Image& image, const Image& reference, double pixels_per_degree = kPixelsPerDegree);

}  // namespace halflight
