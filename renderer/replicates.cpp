#include "renderer/replicates.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <functional>
#include <numeric>
#include <utility>

#include "engine/core/metrics.h"
#include "passes/picture/shadow_catcher.h"
#include "shaders/shared/pixel_order.h"
#include "shaders/shared/sobol.h"

namespace halflight {
namespace {

constexpr std::size_t kCoverage = 9, kShadowValues = 10;  // coverage follows rgb and six sums of catchers

double relative_weight(double reference) {
    return 1 / (reference * reference + kRelativeEpsilon);
}

}  // namespace

SampleView replicate_view(const FrameSettings& frame, const Band& band, int replicate, int index, SamplePoints points) {
    FrameSettings own = frame;
    own.seed = shared::hash_combine(shared::hash_u32(frame.seed), static_cast<std::uint32_t>(replicate));
    // A block of 2^m samples of a Sobol sequence that starts at a multiple of 2^m is as well distributed as the first
    // one.
    const auto number = static_cast<std::uint32_t>(replicate * kMostReplicateSamples + frame.first_sample + index);
    SampleView view = sample_view(own, band, number, points);
    view.first_half = replicate < kReplicates / 2;
    return view;
}

void PictureError::add(std::span<const double> values, ErrorMetric metric) {
    if (metric == ErrorMetric::mse) {
        low_.add(values, 1), high_.add(values, 1);
        return;
    }
    const double sum = std::accumulate(values.begin(), values.end(), 0.0), mean = sum / kReplicates;
    double squares = 0, relative = 0;  // sums of squared deviations, unweighted and weighted
    for (const double v : values) {
        const double square = (v - mean) * (v - mean);
        squares += square;
        relative += square * relative_weight((sum - v) / (kReplicates - 1));
    }
    low_.add(values, relative_weight(mean));
    high_.add(values, squares > 0 ? relative / squares : 0);
}

void PictureError::add(const PictureError& part) {
    low_.add(part.low_), high_.add(part.high_);
    chances_ = std::max(chances_, part.chances_);
}

ErrorEstimate PictureError::judge(double target, int& chances) {
    if (estimate().value < target) ++chances;
    chances_ = chances;
    return estimate();
}

ErrorEstimate PictureError::estimate() const {
    const double confidence = 1 - (1 - kConfidence) * std::exp2(-chances_);
    const ErrorEstimate low = low_.estimate(confidence), high = high_.estimate(confidence);
    return {(low.value + high.value) / 2, std::min(low.lower, high.lower), std::max(low.upper, high.upper),
            std::max(low.bound, high.bound)};
}

int first_chances(int parts) {
    return parts > 1 ? 1 + std::bit_width(static_cast<unsigned>(parts - 1)) : 0;
}

BandReplicates::BandReplicates(const Band& band, Shadows shadows)
    : band_(band), shadows_(shadows), values_(shadows == Shadows::none ? 3 : kShadowValues) {
    const int rows = std::min(band.rows, band.image.y - band.y);
    before_.resize(values_ * static_cast<std::size_t>(rows) * static_cast<std::size_t>(band.image.x));
    replicates_.assign(kReplicates, std::vector<float>(before_.size()));
}

double BandReplicates::value_of(std::size_t i, const Film::Sums& sums) const {
    const std::size_t path = path_of(i / values_), value = i % values_;
    if (value < 3) return sums.beauty(path, value);
    return value < kCoverage ? sums.catchers[kCatcherSums * path + value - 3] : sums.emission[4 * path + 3];
}

void BandReplicates::add(int replicate, const Film::Sums& sums) {
    std::vector<float>& own = replicates_[static_cast<std::size_t>(replicate)];
    for (std::size_t i = 0; i < before_.size(); ++i) {
        const double now = value_of(i, sums);
        own[i] += static_cast<float>(now - std::exchange(before_[i], now));
    }
}

void BandReplicates::add(const BandReplicates& part) {
    for (std::size_t r = 0; r < replicates_.size(); ++r)
        std::ranges::transform(replicates_[r], part.replicates_[r], replicates_[r].begin(), std::plus<>());
}

std::vector<std::vector<std::byte>> BandReplicates::state() const {
    std::vector<std::vector<std::byte>> all;
    const auto add_bytes = [&](std::span<const std::byte> bytes) { all.emplace_back(bytes.begin(), bytes.end()); };
    add_bytes(std::as_bytes(std::span(before_)));
    for (const std::vector<float>& own : replicates_) add_bytes(std::as_bytes(std::span(own)));
    return all;
}

bool BandReplicates::set(std::span<const std::vector<std::byte>> state) {
    if (state.size() != kArrays || state[0].size() != before_.size() * sizeof(double)) return false;
    for (const auto& own : state.subspan(1))
        if (own.size() != before_.size() * sizeof(float)) return false;
    std::memcpy(before_.data(), state[0].data(), state[0].size());
    for (std::size_t r = 0; r < replicates_.size(); ++r)
        std::memcpy(replicates_[r].data(), state[r + 1].data(), state[r + 1].size());
    return true;
}

void BandReplicates::add_error(ErrorMetric metric, std::span<const std::uint32_t> counts, PictureError& picture) const {
    const bool same = counts.size() == 1;
    const std::size_t pixels = before_.size() / values_,
                      row = same ? pixels : std::size_t{16} * static_cast<std::size_t>(band_.image.x);
    for (std::size_t first = 0; first < pixels; first += row) {
        PictureError error;
        for (std::size_t pixel = first; pixel < std::min(first + row, pixels); ++pixel)
            add_pixel(pixel, counts[same ? 0 : path_of(pixel) / 256], metric, error);
        picture.add(error);
    }
}

std::uint32_t BandReplicates::path_of(std::size_t pixel) const {
    const auto number = static_cast<std::uint32_t>(pixel), width = static_cast<std::uint32_t>(band_.image.x);
    return shared::path_of_pixel({number % width, number / width}, band_.tiles());
}

void BandReplicates::add_pixel(std::size_t pixel, double samples, ErrorMetric metric, PictureError& error) const {
    std::array<double, kReplicates> values{};
    const auto of = [&](std::size_t r, std::size_t value) { return double{replicates_[r][values_ * pixel + value]}; };
    if (shadows_ == Shadows::none) {
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t r = 0; r < values.size(); ++r) values[r] = of(r, i) / samples;
            error.add(values, metric);
        }
        return;
    }
    // The shadow 1 - lit / unlit of the picture is a quotient of sums over all replicates. The value of a replicate is
    // the picture's with its own sums in the first-order terms of the quotient (delta method), so that the mean of
    // the values is the picture, and their deviations have its variance.
    const auto mean_of = [&](std::size_t value) {
        double sum = 0;
        for (std::size_t r = 0; r < values.size(); ++r) sum += of(r, value);
        return sum / kReplicates;
    };
    constexpr std::size_t kLit = 3, kUnlit = 4, kMet = 5, kBehind = 6;  // add_shadow_catchers()
    const double unlit = mean_of(kUnlit), share = unlit > 0 ? mean_of(kLit) / unlit : 1;
    const auto add = [&](std::size_t value, std::size_t weight, double sign) {
        const double all = mean_of(weight);
        for (std::size_t r = 0; r < values.size(); ++r) {
            const double lighter = unlit > 0 ? (of(r, kLit) - share * of(r, kUnlit)) / unlit : 0;
            values[r] = (of(r, value) + sign * ((1 - share) * of(r, weight) - all * lighter)) / samples;
        }
        error.add(values, metric);
    };
    for (std::size_t i = 0; i < 3; ++i) add(i, kBehind + i, -1);
    if (shadows_ == Shadows::in_alpha) add(kCoverage, kMet, 1);
}

int next_replicate_samples(int samples, const ErrorEstimate& estimate, double target) {
    const int least = samples + (samples + 3) / 4;
    const double wanted = std::ceil(samples * estimate.bound / target);
    return wanted < 2.0 * samples ? std::max(static_cast<int>(wanted), least) : 2 * samples;
}

}  // namespace halflight
