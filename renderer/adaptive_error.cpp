// Adaptive sampling of a picture that is rendered up to an error. A pilot decides the shares of the blocks and is
// thrown away. All replicates of a block then take the same number of samples, so they are independent and distributed
// alike, as ReplicateError demands. All bands grow together until the picture meets the error, so that it does not
// depend on them.
#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "passes/picture/adaptive.h"
#include "renderer/listed_samples.h"
#include "renderer/render_state.h"

namespace halflight {
namespace {

using Counts = std::vector<std::uint32_t>;

/// A band that is rendered together with the others.
struct GrowingBand {
    Band where;
    std::vector<std::size_t> grid;  // number of each block in the picture, in the order of the band's paths
    BandReplicates replicates;
    Counts first_half, second_half;  // samples of each block so far in the replicates of each half
    bool uneven = false;             // blocks may have different numbers of samples

    GrowingBand(const Band& band, std::vector<std::size_t> blocks)
        : where(band), grid(std::move(blocks)), replicates(band), first_half(grid.size()), second_half(grid.size()) {}

    /// Returns the numbers of samples of the band's blocks. Blocks below the picture have `least`.
    Counts counts_of(const Counts& picture, std::uint32_t least) const {
        Counts counts;
        for (const std::size_t place : grid) counts.push_back(place < picture.size() ? picture[place] : least);
        return counts;
    }
    void add(int replicate, const Counts& from, const Counts& to) {
        Counts& half = replicate < kReplicates / 2 ? first_half : second_half;
        for (std::size_t i = 0; i < half.size(); ++i) half[i] += to[i] - from[i];
    }
};

double mean_of(const Counts& counts) {
    return static_cast<double>(std::accumulate(counts.begin(), counts.end(), std::uint64_t{0})) /
           static_cast<double>(counts.size());
}

}  // namespace

void Renderer::State::keep_sums_of_bands() {
    if (own_sums || bands == 1) return;
    own_sums = true;
    places.resize(1);  // the first band has sums of its own in any case
    places.resize(std::size_t(bands));
}

std::vector<double> Renderer::State::plan_replicates(const FrameSettings& frame,
                                                     const std::function<bool()>& after_sample) {
    const ErrorTarget& target = *frame.error;
    const int first = pilot_samples(0);
    std::vector<float> errors = pilot_errors(frame, 0, first, target.metric, after_sample);
    if (errors.empty()) return {};
    std::vector<double> deviations = block_deviations(errors, picture_blocks());
    // Sequences converge faster than independent samples, of which fewer than half are needed in most pictures.
    const int pilot = pilot_samples(std::min(frame.samples, expected_samples(deviations, target.error) / 2));
    if (pilot == first) return deviations;
    errors = pilot_errors(frame, first, pilot, target.metric, after_sample);
    if (errors.empty()) return {};
    return block_deviations(errors, picture_blocks());
}

void Renderer::State::render_to_error_adaptively(const FrameSettings& frame, std::vector<int>& done,
                                                 const std::function<bool(std::int64_t all)>& go_on,
                                                 PictureError& picture_error) {
    const Stopwatch watch;
    keep_sums_of_bands();
    const std::vector<double> deviations =
        plan_replicates(frame, [&] { return go_on(std::int64_t{kFirstLook} * kReplicates * bands); });
    const double planned = watch.seconds();
    std::vector<GrowingBand> growing;
    for (int b = 0; b < bands; ++b) {
        growing.emplace_back(band_at(b), blocks_in_picture(band_at(b)));
        CompiledBand& with = compiled(b);
        with.mattes->clear();
        with.samples.clear();
        with.first_samples = 0;
    }
    const SamplePoints points = settings.estimator.sampler;
    const int most = std::min(frame.samples / kReplicates, kMostReplicateSamples);
    Counts counts(deviations.size());  // number of samples of each block in each replicate
    /// Adds the samples of a replicate that a band lacks; returns false to stop.
    const auto grow = [&](int b, int r, int each, int next, const Counts& wanted) {
        GrowingBand& g = growing[std::size_t(b)];
        CompiledBand& with = compiled(b);
        const auto view = [&](std::uint32_t number) {
            return replicate_view(frame, g.where, r, static_cast<int>(number), points);
        };
        const auto all = std::int64_t{next} * kReplicates * bands;
        const double before = double{1} * each * kReplicates + double{1} * r * (next - each);
        bool goes_on = true;
        Counts from = g.counts_of(counts, each == 0 ? 0 : kFirstLook);
        for (std::uint32_t i = 0; each == 0 && goes_on && i < kFirstLook; ++i) {  // samples of all pixels
            add_sample(frame, view(i), with, SampleKind::plain);
            const Counts more(from.size(), i + 1);
            g.add(r, from, more);
            from = more;
            ++done[std::size_t(b)];
            goes_on = go_on(all);
        }
        if (!goes_on) return false;
        g.uneven = g.uneven || each > 0;
        ListedSamples listed(from, g.counts_of(wanted, kFirstLook), view);
        goes_on = add_listed(frame, view(kFirstLook), with, listed, [&](double share) {
            done[std::size_t(b)] = static_cast<int>(before + share * (next - each));
            return go_on(all);
        });
        g.add(r, from, listed.taken());
        if (goes_on) g.replicates.add(r, light(with.sums));
        return goes_on;
    };

    bool goes_on = !deviations.empty();
    int each = 0;  // mean number of samples of a replicate
    for (int next = kFirstLook, chances = 0; goes_on && next > each;) {
        const Counts wanted =
            replicate_counts(deviations, static_cast<std::uint32_t>(next), kFirstLook, kMostReplicateSamples);
        for (int b = 0; goes_on && b < bands; ++b)
            for (int r = 0; goes_on && r < kReplicates; ++r) goes_on = grow(b, r, each, next, wanted);
        if (!goes_on) break;
        counts = wanted, each = next;
        picture_error = PictureError();
        for (const GrowingBand& g : growing)
            g.replicates.add_error(frame.error->metric, g.counts_of(counts, kFirstLook), picture_error);
        const ErrorEstimate estimate = picture_error.judge(frame.error->error, chances);
        if (estimate.bound <= frame.error->error) break;
        next = std::min(next_replicate_samples(each, estimate, frame.error->error), most);
        if (frame.time_limit > 0)
            next = static_cast<int>(std::min<double>(
                next, each * (frame.time_limit - planned) / std::max(watch.seconds() - planned, 1e-9)));
    }
    if (deviations.empty()) {  // a picture that ends in the pilot gets one sample
        const auto stop = [](int, int) { return false; };
        done[0] = render_band(frame, band_at(0), compiled(0), 0, 0, stop);
        return;
    }
    for (int b = 0; b < bands; ++b) {
        GrowingBand& g = growing[std::size_t(b)];
        CompiledBand& with = compiled(b);
        if (!g.uneven) continue;
        with.first_samples = kFirstLook * kReplicates;
        with.samples.resize(g.grid.size());
        std::ranges::transform(g.first_half, g.second_half, with.samples.begin(), std::plus<>());
        const double mean = goes_on ? kReplicates * mean_of(counts) : mean_of(with.samples);
        const int wanted = done[std::size_t(b)] = 2 * static_cast<int>(std::lround(mean / 2));
        scale_sums(with, g.first_half, wanted);
    }
}

}  // namespace halflight
