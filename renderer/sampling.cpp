#include "renderer/sampling.h"

#include <algorithm>
#include <utility>

#include "engine/core/interruption.h"
#include "passes/picture/adaptive.h"

namespace halflight {

Renderer::State::Sampling::Sampling(State& state, const FrameSettings& frame, const SamplePlan& plan,
                                    const Stopwatch& watch, std::vector<int>& done, GoOn go_on)
    : s_(state),
      frame_(frame),
      watch_(watch),
      done_(done),
      go_on_(std::move(go_on)),
      plan_(plan),
      checkpoint_(state.inputs.checkpoint) {}

void Renderer::State::Sampling::run(const std::function<void(int band)>& rendered) {
    if (plan_.together) s_.bands.keep_sums();
    if (plan_.least > 0 && !find_noise()) {
        // A picture that ends in the pilot gets one sample, and there is no plan to go on with.
        plan_ = {.samples = frame_.samples, .most = frame_.samples, .first_look = frame_.samples};
        checkpoint_ = nullptr;
        stopped_ = false;  // until that sample is there
    }
    const int size = plan_.together ? s_.bands.count : 1;
    for (first_band_ = 0; first_band_ < s_.bands.count && (first_band_ == 0 || !stopped_); first_band_ += size) {
        std::vector<BandSamples> group;
        for (int b = 0; b < size; ++b) group.push_back(begin(first_band_ + b));
        grow(group);
        for (BandSamples& band : group) {
            finish(band);
            if (done_[std::size_t(band.index)] > 0) rendered(band.index);
        }
    }
}

auto Renderer::State::Sampling::begin(int index) -> BandSamples {
    BandSamples band{.index = index, .where = s_.bands.at(index), .with = &s_.compiled(index)};
    band.with->mattes->clear();
    band.with->first_samples = 0;
    band.with->samples.clear();
    band.look.next = plan_.first_look;
    if (plan_.sequences > 1) band.replicates.emplace(band.where);
    if (plan_.least > 0) {
        band.grid = blocks_in_picture(band.where);
        band.taken.resize(band.grid.size()), band.first_halves.resize(band.grid.size());
    }
    if (!s_.inputs.merged.empty())
        merge(band);
    else if (checkpoint_)
        restore(band);
    return band;
}

void Renderer::State::Sampling::grow(std::span<BandSamples> group) {
    const double spent = watch_.seconds() + (checkpoint_ ? checkpoint_->earlier_seconds() : 0);
    const int groups = plan_.together ? 1 : s_.bands.count - first_band_;  // that are left
    limit_ = frame_.time_limit > 0 ? std::max((frame_.time_limit - spent) / groups, 1e-9) : 0.0;
    clock_ = {}, pace_ = {}, part_ = 1;
    compiled_before_ = s_.scene.programs().compile_seconds();
    const Look& look = group.front().look;
    for (;; ++part_) {
        if (!look.ends) {
            if (!deviations_.empty())
                wanted_ = replicate_counts(deviations_, static_cast<std::uint32_t>(look.next),
                                           static_cast<std::uint32_t>(plan_.least), kMostReplicateSamples);
            for (BandSamples& band : group) {
                for (Look& l = band.look; !stopped_ && l.sequence < plan_.sequences;)
                    if (add_sequence(band)) ++l.sequence, l.taken = 0, l.runs = 0;
                if (plan_.parts > 1) s_.in_flight->drain(), band.parts.add(band.with->sums);
                if (stopped_) return;
            }
            counts_ = wanted_;
            for (BandSamples& band : group) band.look.each = band.look.next, band.look.sequence = 0;
        }
        int chances = look.chances;
        const int next = next_look(group, chances);
        const bool ends = look.ends || next <= look.each;
        for (BandSamples& band : group) {
            band.look.ends = ends;
            if (!ends) band.look.next = next, band.look.chances = chances;
        }
        if (ends) break;
    }
    error_.add(group_error_);
}

bool Renderer::State::Sampling::add_sequence(BandSamples& band) {
    Look& look = band.look;
    const SamplePoints points = s_.settings.estimator.sampler;
    const FrameSettings own = plan_.parts > 1 ? settings_of_part(frame_, part_) : frame_;
    const auto view = [&](int index) { return view_of(plan_, own, band.where, look.sequence, index, points); };
    const int all = plan_.least > 0 ? std::min(look.next, plan_.least) : look.next;  // samples that all pixels take
    const std::vector<int> order = plan_.by_time ? order_of_samples(own, look.each, all, view) : std::vector<int>();
    while (look.each + look.taken < all) {
        const int index = look.each + look.taken;
        if (index < plan_.cached) {
            const std::uint32_t first = (s_.cache->picture() - 1) * kCachedSamples;
            add(band, own, cached_view(own, band.where, first, static_cast<std::uint32_t>(index), points),
                SampleKind::cached);
        } else {
            if (index > 0 && index == plan_.cached) {
                s_.in_flight->wait();
                band.with->mattes->clear();
            }
            SampleView sample = view(order.empty() ? index - plan_.cached : order[std::size_t(look.taken)]);
            const bool first = plan_.parts > 1 ? look.taken == 0 : index == plan_.cached;
            sample.begins = first && look.sequence == 0;
            add(band, own, sample, SampleKind::plain);
        }
        ++look.taken;
        if (!go_on(band, plan_.done(look.each, look.next, look.sequence, look.taken))) return false;
    }
    if (plan_.least > 0 && !add_listed(band, [&](std::uint32_t index) { return view(static_cast<int>(index)); }))
        return false;
    if (band.replicates) band.replicates->add(look.sequence, light(band.with->sums));
    return true;
}

void Renderer::State::Sampling::add(const BandSamples& band, const FrameSettings& frame, const SampleView& at,
                                    SampleKind kind) {
    const std::uint64_t interrupted = interruptions();
    try {
        s_.add_sample(frame, at, *band.with, kind);
    } catch (...) {
        // The sums are those of the last sample: points of interruption precede the pass that adds to them.
        if (interruptions() != interrupted) save(band);
        throw;
    }
}

bool Renderer::State::Sampling::go_on(const BandSamples& band, int done) {
    done_[std::size_t(band.index)] = done;
    std::int64_t all = std::int64_t{plan_.expected(band.look.next)} * (s_.bands.count - first_band_);
    for (int b = 0; b < first_band_; ++b) all += done_[std::size_t(b)];
    stopped_ = !go_on_(all);
    pace_.add(clock_.seconds(), s_.scene.programs().compile_seconds() - compiled_before_);
    if (stopped_ || (checkpoint_ && checkpoint_->due())) save(band);
    return !stopped_;
}

int Renderer::State::Sampling::next_look(std::span<const BandSamples> group, int& chances) {
    const Look& look = group.front().look;
    if (frame_.error) {
        const ErrorTarget& target = *frame_.error;
        group_error_ = PictureError();
        for (const BandSamples& band : group) {
            const Counts counts = plan_.least > 0 ? counts_of(band, counts_) : Counts(1, std::uint32_t(look.each));
            band.replicates->add_error(target.metric, counts, group_error_);
        }
        const ErrorEstimate estimate = group_error_.judge(target.error, chances);
        if (estimate.bound <= target.error) return look.each;
        const int next = std::min(next_replicate_samples(look.each, estimate, target.error), plan_.most);
        if (!(limit_ > 0)) return next;
        const double overhead = pace_.overhead();
        const double left = (limit_ - overhead) / std::max(clock_.seconds() - overhead, 1e-9);
        return static_cast<int>(std::min<double>(next, look.each * left));
    }
    if (look.each >= plan_.most) return look.each;
    if (plan_.parts > 1) return look.each + settings_of_part(frame_, part_ + 1).samples;
    const int least = has_halves(s_.settings) ? 2 : 1;  // samples that the filter needs
    const bool time_is_up = limit_ > 0 && look.each >= least && !pace_.another_fits(limit_, group.size());
    return look.each + (time_is_up ? 0 : 1);
}

void Renderer::State::Sampling::finish(BandSamples& band) {
    if (plan_.parts > 1) band.parts.write(band.with->sums);
    if (band.uneven) scale(band);
    if (band.look.ends && !band.restored) save(band);
}

}  // namespace halflight
