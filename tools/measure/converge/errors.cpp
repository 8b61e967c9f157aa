#include "tools/measure/converge/errors.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/core/metrics.h"
#include "tools/measure/common/flip.h"
#include "tools/measure/common/seed_errors.h"

namespace halflight::converge {
namespace {

/// Returns the mse without the worst pixels, which are those of the greatest squared errors in `map`.
double trimmed_mse(const Image& x, const Image& half0, const Image& half1, const Image& map) {
    std::vector<float> sorted = map.pixels;
    const auto kept = static_cast<std::ptrdiff_t>((1 - kWorstShare) * static_cast<double>(sorted.size()));
    if (kept < 1) return 0;
    std::nth_element(sorted.begin(), sorted.begin() + kept - 1, sorted.end());
    Image weights(x.width, x.height, x.channels);
    const auto channels = static_cast<std::size_t>(x.channels);
    for (std::size_t i = 0; i < weights.pixels.size(); ++i)
        weights.pixels[i] = map.pixels[i / channels] <= sorted[static_cast<std::size_t>(kept - 1)] ? 1.0f : 0.0f;
    return seed_errors({&x, 1}, half0, half1, weights).mse.value / mean_of(weights);
}

/// Returns the standard error of the mean of both halves, from blocks of pixels: neighbours may share samples.
double error_of_mean(const Image& half0, const Image& half1) {
    constexpr int kBlock = 16;  // side of a block, pixels; the engine's groups that share samples are not larger
    const int columns = (half0.width + kBlock - 1) / kBlock, rows = (half0.height + kBlock - 1) / kBlock;
    std::vector<double> blocks(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
    for (int y = 0; y < half0.height; ++y)
        for (int x = 0; x < half0.width; ++x)
            for (int c = 0; c < half0.channels; ++c)
                blocks[static_cast<std::size_t>(y / kBlock * columns + x / kBlock)] +=
                    (double{half0.at(x, y)[c]} - half1.at(x, y)[c]) / 2;
    double squares = 0;
    for (const double block : blocks) squares += block * block;
    return std::sqrt(squares) / static_cast<double>(half0.pixels.size());
}

}  // namespace

RunErrors run_errors(const Picture& picture, const Reference& reference) {
    const auto& [half0, half1] = reference.halves;
    RunErrors errors;
    errors.flip = mean_of(hdr_flip_map(picture.beauty, reference.mean.beauty));
    errors.trimmed_mse = trimmed_mse(picture.beauty, half0.beauty, half1.beauty,
                                     squared_error_map(picture.beauty, reference.mean.beauty));
    errors.has_components = reference.has_components && picture.has_components();
    for (std::size_t c = 0; c < kComponents.size() && errors.has_components; ++c)
        errors.components[c] =
            seed_errors({&picture.components[c], 1}, half0.components[c], half1.components[c]).mse.value;
    return errors;
}

Image weights_off_edges(const Reference& reference) {
    constexpr float kEdge = 0.1f;
    if (!reference.has_components) return {};
    const Image& emission = reference.mean.components[0];
    Image weights(emission.width, emission.height, emission.channels);
    for (int y = 0; y < emission.height; ++y) {
        for (int x = 0; x < emission.width; ++x) {
            bool edge = false;
            for (int c = 0; c < emission.channels; ++c) {
                float least = std::numeric_limits<float>::infinity(), most = 0;
                for (int v = std::max(y - 1, 0); v <= std::min(y + 1, emission.height - 1); ++v)
                    for (int u = std::max(x - 1, 0); u <= std::min(x + 1, emission.width - 1); ++u)
                        least = std::min(least, emission.at(u, v)[c]), most = std::max(most, emission.at(u, v)[c]);
                edge = edge || most - least > kEdge * most;
            }
            std::fill_n(weights.at(x, y), emission.channels, edge ? 0.0f : 1.0f);
        }
    }
    return weights;
}

Interval relative_bias(std::span<const Image> renders, const Reference& reference) {
    const double brightness = mean_of(reference.mean.beauty);
    std::vector<double> means;
    for (const Image& render : renders) means.push_back(mean_of(render) / brightness - 1);
    Interval bias = mean_interval(means);
    const double noise = error_of_mean(reference.halves[0].beauty, reference.halves[1].beauty);
    bias.half_width = std::hypot(bias.half_width, kNormalQuantile * noise / brightness);
    return bias;
}

}  // namespace halflight::converge
