// Error metrics of one run, and the signed bias of a method.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "engine/core/statistics.h"
#include "tools/measure/converge/reference.h"

namespace halflight::converge {

/// Errors of one picture. Squared errors are means over pixels and channels without the reference's own variance. They
/// may be negative if the reference is noisier than the picture (tools/measure/common/seed_errors.h).
struct RunErrors {
    double flip = 0;                                      // HDR-FLIP against the reference's mean, [0, 1]
    double trimmed_mse = 0;                               // mse without the worst pixels (kWorstShare)
    bool has_components = false;                          // both picture and reference have components
    std::array<double, kComponents.size()> components{};  // mse of each component, or 0
};
RunErrors run_errors(const Picture& picture, const Reference& reference);

/// Returns weights of squared errors: 0 for pixels that an edge of a light crosses, 1 for all others. At an edge, the
/// reference's emission in a pixel and its neighbours differs by more than a tenth of their maximum. Returns an empty
/// image for a reference without components.
Image weights_off_edges(const Reference& reference);

/// Returns (mean of the expectation) / (mean of the reference) - 1 over all pixels and channels. The interval contains
/// the scatter of the renders, which must be independent, and of the reference.
Interval relative_bias(std::span<const Image> renders, const Reference& reference);

}  // namespace halflight::converge
