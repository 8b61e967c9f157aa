#include "renderer/replicates.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numeric>
#include <utility>

#include "engine/core/metrics.h"
#include "shaders/shared/pixel_order.h"
#include "shaders/shared/sobol.h"

namespace halflight {
namespace {

double relative_weight(double reference) {
    return 1 / (reference * reference + kRelativeEpsilon);
}

}  // namespace

SampleView replicate_view(const FrameSettings& frame, const Band& band, int replicate, int index, SamplePoints points) {
    FrameSettings own = frame;
    own.seed = shared::hash_combine(shared::hash_u32(frame.seed), static_cast<std::uint32_t>(replicate));
    // A block of 2^m samples of a Sobol sequence that starts at a multiple of 2^m is as well distributed as the first
    // one. Only the first replicate has sample 0, which overwrites the sums.
    const auto number = static_cast<std::uint32_t>(replicate * kMostReplicateSamples + index);
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

BandReplicates::BandReplicates(const Band& band) : band_(band) {
    const int rows = std::min(band.rows, band.image.y - band.y);
    before_.resize(3 * static_cast<std::size_t>(rows) * static_cast<std::size_t>(band.image.x));
    replicates_.assign(kReplicates, std::vector<float>(before_.size()));
}

void BandReplicates::add(int replicate, const Film::Sums& sums) {
    std::vector<float>& own = replicates_[static_cast<std::size_t>(replicate)];
    for (std::size_t i = 0; i < before_.size(); ++i) {
        const double now = sums.beauty(path_of(i), i % 3);
        own[i] += static_cast<float>(now - std::exchange(before_[i], now));
    }
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
    const std::size_t row =  // values in a row of blocks, or all
        same ? before_.size() : std::size_t{3} * 16 * static_cast<std::size_t>(band_.image.x);
    for (std::size_t first = 0; first < before_.size(); first += row) {
        PictureError error;
        for (std::size_t i = first; i < std::min(first + row, before_.size()); ++i)
            add_value(i, counts[same ? 0 : path_of(i) / 256], metric, error);
        picture.add(error);
    }
}

std::uint32_t BandReplicates::path_of(std::size_t value) const {
    const auto pixel = static_cast<std::uint32_t>(value / 3), width = static_cast<std::uint32_t>(band_.image.x);
    return shared::path_of_pixel({pixel % width, pixel / width}, band_.tiles());
}

void BandReplicates::add_value(std::size_t i, double samples, ErrorMetric metric, PictureError& error) const {
    std::array<double, kReplicates> values{};
    for (std::size_t r = 0; r < values.size(); ++r) values[r] = double{replicates_[r][i]} / samples;
    error.add(values, metric);
}

int next_replicate_samples(int samples, const ErrorEstimate& estimate, double target) {
    const int least = samples + (samples + 3) / 4;
    const double wanted = std::ceil(samples * estimate.bound / target);
    return wanted < 2.0 * samples ? std::max(static_cast<int>(wanted), least) : 2 * samples;
}

}  // namespace halflight
