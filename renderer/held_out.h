// Estimate of the error of a denoised picture from held-out samples.
//
// The error of the mean of samples shows in their variance; that of a biased picture does not. Two further pictures of
// the same frame, with samples of their own, are independent of the denoised picture D and of each other, and unbiased.
// The mean of (D - first) (D - second) over all pixels is therefore an unbiased estimate of the squared error of D,
// however noisy both are.
#pragma once

#include <functional>

#include "engine/core/image.h"
#include "renderer/render.h"

namespace halflight {

/// Renders the frame with these settings and returns the result, which is not denoised and has no layers.
using RenderNoisy = std::function<RenderResult(const FrameSettings& settings, const ProgressCallback& progress)>;

/// Renders two further pictures of RenderSettings::denoise_error samples and enters the error of the denoised picture
/// into its statistics. Does nothing for a picture that is not denoised. If the callback stops it, the result is
/// marked as interrupted.
void estimate_denoised_error(const RenderSettings& settings, RenderResult& result, const RenderNoisy& render,
                             const ProgressCallback& progress);

/// Returns the error of a picture from two independent, unbiased and noisy ones. Noise is taken as
/// independent between blocks of 16x16 pixels, within which pixels may share paths. Pictures: RGB or RGBA of the same
/// size, whose alpha does not count. Relative errors refer to the mean square of the 3x3 pixels around in `picture`: a
/// single pixel may have missed its light. The value of a small error may be negative; limits and bound are at least 0.
ErrorEstimate held_out_error(const Image& picture, const Image& first, const Image& second, ErrorMetric metric);

}  // namespace halflight
