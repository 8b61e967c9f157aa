// Runs the whole renderer in tests: pictures, components, and means with their errors.
#pragma once

#include <string_view>

#include "engine/core/image_tools.h"
#include "renderer/render.h"

namespace halflight::test {

/// Returns settings for a small picture with all five components and the variance.
RenderSettings small_settings(const Camera& camera, int width, int height, int samples, int bounces);

/// Returns settings for a small picture by the scene's first camera with all AOVs.
RenderSettings all_settings(const Scene& scene, int width, int height, int samples);

RenderResult render(gpu::Context& context, const Scene& scene, const RenderSettings& settings);

/// Returns the layer that holds a channel ("albedo.R", "Z"). Throws std::out_of_range if there is none.
const Image& layer(const RenderResult& result, std::string_view channel);
/// Compares beauty, view and AOVs bit by bit.
void expect_same(const RenderResult& a, const RenderResult& b);
/// Compares beauty, view and all layers of `b` bit by bit. `a` may have further layers.
void expect_includes(const RenderResult& a, const RenderResult& b);

struct MeanValue {
    double value = 0;
    double error = 0;  // standard error, for independent pixels
};
/// Returns the mean of one channel over the whole picture; its error comes from the AOV "variance".
MeanValue mean_radiance(const RenderResult& result, int channel);
/// Returns the mean of one channel over the whole picture; its error comes from the scatter of the pixels.
MeanValue mean_of_pixels(const Image& image, int channel);

}  // namespace halflight::test
