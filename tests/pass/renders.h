// The whole renderer in tests: pictures, components, and means with their errors.
#pragma once

#include <string>

#include "engine/core/image_tools.h"
#include "renderer/render.h"

namespace halflight::test {

/// Settings for a small picture with all five components and the variance.
RenderSettings small_settings(const Camera& camera, int width, int height, int samples, int bounces);

/// Settings for a small picture by the scene's first camera with all that it can show.
RenderSettings all_settings(const Scene& scene, int width, int height, int samples);

RenderResult render(gpu::Context& context, const Scene& scene, const RenderSettings& settings);

/// Layer that holds a channel ("albedo.R", "Z"). Throws std::out_of_range where there is none.
const Image& layer(const RenderResult& result, const std::string& channel);
/// Beauty, view and AOVs.
void expect_same(const RenderResult& a, const RenderResult& b);

struct MeanValue {
    double value = 0;
    double error = 0;  // standard error, pixels taken as independent
};
/// Of one channel over the whole picture, from the "variance" AOV.
MeanValue mean_radiance(const RenderResult& result, int channel);
/// Of one channel over the whole picture, from the scatter of its pixels.
MeanValue mean_of_pixels(const Image& image, int channel);

}  // namespace halflight::test
