#include "renderer/held_out.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/core/metrics.h"
#include "engine/core/statistics.h"
#include "engine/core/stopwatch.h"
#include "shaders/shared/sobol.h"

namespace halflight {
namespace {

/// Returns the mean square of a channel of the 3x3 pixels around; pixels at the border count for those outside.
double square_around(const Image& image, int x, int y, int channel) {
    double sum = 0;
    for (int j = y - 1; j <= y + 1; ++j)
        for (int i = x - 1; i <= x + 1; ++i) {
            const double v = image.at(std::clamp(i, 0, image.width - 1), std::clamp(j, 0, image.height - 1))[channel];
            sum += v * v;
        }
    return sum / 9;
}

}  // namespace

ErrorEstimate held_out_error(const Image& picture, const Image& first, const Image& second, ErrorMetric metric) {
    constexpr int kBlock = 16;  // width of the blocks in which pixels share paths (shaders/shared/reuse_groups.h)
    const int width = picture.width, height = picture.height, across = (width + kBlock - 1) / kBlock;
    std::vector<double> deviations(std::size_t(across) * std::size_t((height + kBlock - 1) / kBlock));
    double sum = 0;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const auto at = [&](const Image& image) { return image.at(x, y); };
            double& deviation = deviations[std::size_t(y / kBlock) * std::size_t(across) + std::size_t(x / kBlock)];
            for (int c = 0; c < 3; ++c) {
                const double own = double{at(picture)[c]}, a = own - at(first)[c], b = own - at(second)[c];
                const double weight =
                    metric == ErrorMetric::mse ? 1.0 : 1 / (square_around(picture, x, y, c) + kRelativeEpsilon);
                sum += weight * a * b;
                // The product a b is (s s - d d) / 4 with d = a - b and s = a + b. The sign of d is random, given the
                // picture, and the variance of s d / 2 is that of a b for normal noise, and larger for heavy tails.
                deviation += weight * (a - b) * (a + b) / 2;
            }
        }
    }
    double squares = 0;
    for (const double d : deviations) squares += d * d;
    const double values = 3.0 * width * height, value = sum / values, error = std::sqrt(squares) / values;
    // Deviations are products, whose squares vary up to four times as much as those of normal values.
    const double freedom = std::max(static_cast<double>(deviations.size()) / 2, 1.0);
    const double two_sided = student_quantile(kConfidence, freedom),
                 one_sided = student_quantile(2 * kConfidence - 1, freedom);
    const auto limit = [&](double quantile) { return std::max(value + quantile * error, 0.0); };
    return {value, limit(-two_sided), limit(two_sided), limit(one_sided)};
}

void estimate_denoised_error(const RenderSettings& settings, RenderResult& result, const RenderNoisy& render,
                             const ProgressCallback& progress) {
    if (!result.stats.denoised || result.stats.interrupted) return;
    const Stopwatch watch;
    const int done = result.stats.samples, more = settings.denoise_error;
    FrameSettings frame = settings;
    frame.error.reset();
    frame.time_limit = 0;
    frame.stays_noisy = true;
    frame.samples = more;
    Image pictures[2];
    for (std::uint32_t k : {0u, 1u}) {
        frame.seed = shared::hash_combine(shared::hash_u32(settings.seed), 0x68656c64 + k);
        const auto of_all = [&](RenderProgress p) {
            p.samples_done += done + static_cast<int>(k) * more;
            p.samples_total = done + 2 * more;
            p.picture = {};
            return !progress || progress(p);
        };
        RenderResult made = render(frame, of_all);
        if (made.stats.interrupted) {
            result.stats.interrupted = true;
            return;
        }
        pictures[k] = std::move(made.beauty);
    }
    const ErrorMetric metric = settings.error ? settings.error->metric : ErrorMetric::relmse;
    result.stats.denoised_error = {metric, held_out_error(result.beauty, pictures[0], pictures[1], metric), more,
                                   watch.seconds()};
}

}  // namespace halflight
