#include "tools/measure/common/seed_errors.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "engine/core/metrics.h"

namespace halflight {
namespace {

// Let mu be the true value of a pixel, a_s = mu + b + n_s the renders (bias b, noise n_s of mean 0) and r_i = mu + d_i
// the references (noise d_i of mean 0). All noises are independent, hence
//   x_s = a_s - r_1 = b + n_s - d_1,   y_s = a_s - r_2 = b + n_s - d_2
//   E[x_s y_s] = b^2 + var n              squared error of a render: no square of d_1 or d_2 is left
//   E[x_s y_t] = b^2 for s != t           squared bias
//   E[(r_1 - r_2)^2] = var d_1 + var d_2
// The mean of x_s y_t over the K (K - 1) pairs s != t is (X Y - XY) / (K (K - 1)), with X, Y, XY the sums of x_s, y_s,
// x_s y_s. The difference of the two is the sample variance (XY - X Y / K) / (K - 1), which does not depend on r_1 and
// r_2.
//
// The jackknife over renders estimates the scatter of these means due to n_s. All renders share the contribution of r_1
// and r_2,
//   d_1 d_2 - b (d_1 + d_2),  of variance v^2 + 2 b^2 v  with v = var d_i, assumed equal for both.
// Let u = (r_1 - r_2)^2 and B the estimate of b^2 in a pixel, which contains d_1 d_2 - b (d_1 + d_2). For normal d_i
//   E[u^2] = 12 v^2,  E[u B] = 2 b^2 v - 2 v^2,  hence  E[u (u / 4 + B)] = v^2 + 2 b^2 v.
// Means of many samples are close to normal. For symmetric noise with heavier tails, or if b <= 0, the estimate is
// too large by at most four times the references' variance. It is too small by up to about half where the noise is
// skewed to bright and b is about as large as its deviation. Neighbours cannot help: a pixel on an edge has all the
// noise. Channels of a pixel are correlated: their standard deviations add.

/// Sums over the channels of a pixel, each value weighted.
struct Pixel {
    double squares_about_reference = 0;  // squared distances from the mean of the two, summed over renders
    double bias = 0;                     // estimate of b^2
    double spread = 0;                   // u
};

class Sums {
  public:
    Sums(std::span<const Image> renders, const Image& first, const Image& second, const Image& weights)
        : renders_(renders),
          first_(first),
          second_(second),
          weights_(weights),
          of_render_(renders.size()),
          without_(renders.size()) {}

    Pixel add(std::size_t pixel) {
        const auto channels = static_cast<std::size_t>(first_.channels);
        Pixel sum;
        for (std::size_t i = pixel * channels; i < (pixel + 1) * channels; ++i) add_value(i, sum);
        return sum;
    }

    SeedErrors errors() const {
        const auto count = static_cast<double>(first_.pixels.size());
        const auto k = static_cast<double>(renders_.size());
        SeedErrors result;
        for (const double e : of_render_) result.of_render.push_back(e / count);
        result.mse = mean_interval(result.of_render);
        if (renders_.size() < 2) {
            result.squared_bias = result.variance = jackknife_interval(0, {});
            return result;
        }
        const double bias = pairs_ / count;
        std::vector<double> biases, variances;
        for (std::size_t s = 0; s < renders_.size() && renders_.size() > 2; ++s) {
            biases.push_back(without_[s] / ((k - 1) * (k - 2) * count));
            variances.push_back((k * result.mse.value - result.of_render[s]) / (k - 1) - biases.back());
        }
        result.squared_bias = jackknife_interval(bias, biases);
        result.variance = jackknife_interval(result.mse.value - bias, variances);
        return result;
    }

  private:
    void add_value(std::size_t i, Pixel& pixel) {
        const double w = weights_.pixels.empty() ? 1 : weights_.pixels[i];
        const double r1 = first_.pixels[i], r2 = second_.pixels[i];
        double x = 0, y = 0, xy = 0;
        for (const Image& render : renders_) {
            const double a = render.pixels[i];
            x += a - r1, y += a - r2, xy += (a - r1) * (a - r2);
            pixel.squares_about_reference += w * std::pow(a - (r1 + r2) / 2, 2);
        }
        for (std::size_t s = 0; s < renders_.size(); ++s) {
            const double xs = renders_[s].pixels[i] - r1, ys = renders_[s].pixels[i] - r2;
            of_render_[s] += w * xs * ys;
            without_[s] += w * ((x - xs) * (y - ys) - (xy - xs * ys));
        }
        if (renders_.size() > 1) {
            const double bias = w * (x * y - xy) / static_cast<double>(renders_.size() * (renders_.size() - 1));
            pairs_ += bias;
            pixel.bias += bias;
        }
        pixel.spread += w * (r1 - r2) * (r1 - r2);
    }

    std::span<const Image> renders_;
    const Image &first_, &second_, &weights_;
    std::vector<double> of_render_;  // x_s y_s
    std::vector<double> without_;    // sum of x_s y_t over the pairs without render s
    double pairs_ = 0;               // mean of x_s y_t over all pairs
};

void widen(Interval& interval, double variance) {
    interval.half_width = std::hypot(interval.half_width, kNormalQuantile * std::sqrt(variance));
}

}  // namespace

SeedErrors seed_errors(std::span<const Image> renders, const Image& first, const Image& second, const Image& weights) {
    assert(!renders.empty() && first.pixels.size() == second.pixels.size());
    assert(weights.pixels.empty() || weights.pixels.size() == first.pixels.size());
    assert(std::ranges::all_of(renders, [&](const Image& r) { return r.pixels.size() == first.pixels.size(); }));
    Sums sums(renders, first, second, weights);
    std::vector<Pixel> pixels;
    for (std::size_t p = 0; p < first.pixels.size() / static_cast<std::size_t>(first.channels); ++p)
        pixels.push_back(sums.add(p));
    SeedErrors result = sums.errors();

    const auto count = static_cast<double>(first.pixels.size());
    std::vector<float> squares;
    double reference_scatter = 0;
    for (const Pixel& pixel : pixels) {
        reference_scatter += pixel.spread * (pixel.spread / 4 + pixel.bias);
        result.reference_variance += pixel.spread / (4 * count);
        squares.push_back(static_cast<float>(pixel.squares_about_reference));
    }
    result.worst_share = worst_share(squares);
    reference_scatter = std::max(reference_scatter, 0.0) / (count * count);
    widen(result.mse, reference_scatter);
    widen(result.squared_bias, reference_scatter);
    return result;
}

Image relative_weights(const Image& reference) {
    Image weights = reference;
    for (float& v : weights.pixels) v = static_cast<float>(1 / (double{v} * v + kRelativeEpsilon));
    return weights;
}

}  // namespace halflight
