// What engine/core's error metrics leave out: errors of one run, and a signed bias.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "engine/core/statistics.h"
#include "tools/measure/converge/reference.h"

namespace halflight::converge {

/// Of one picture; squared errors are means over pixels and channels without the reference's own variance, and may be
/// negative where the reference is noisier than the picture (tools/measure/common/seed_errors.h).
struct RunErrors {
    double flip = 0;                                      // HDR-FLIP against the reference's mean, [0, 1]
    double trimmed_mse = 0;                               // without the worst pixels (kWorstShare)
    bool has_components = false;                          // picture and reference do
    std::array<double, kComponents.size()> components{};  // mse of each, or 0
};
RunErrors run_errors(const Picture& picture, const Reference& reference);

/// 0 for pixels that an edge of what glows crosses, 1 for others, as weights of squared errors: where pixel and its
/// neighbours in the reference differ by more than a tenth of the brightest one's emission. Empty without components.
Image weights_off_edges(const Reference& reference);

/// (mean of the expectation) / (mean of the reference) - 1, over all pixels and channels. The interval holds the
/// scatter of the renders, which must be independent, and of the reference.
Interval relative_bias(std::span<const Image> renders, const Reference& reference);

}  // namespace halflight::converge
