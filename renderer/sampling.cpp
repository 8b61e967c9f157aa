#include "renderer/sampling.h"

#include <algorithm>
#include <utility>

#include "engine/core/error.h"
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
      checkpoint_(state.inputs.checkpoint),
      parts_(plan.parts),
      shadows_(!state.scene.tables().catchers                                 ? Shadows::none
               : state.scene.has_environment() && !state.settings.transparent ? Shadows::in_color
                                                                              : Shadows::in_alpha),
      plan_(plan) {}

void Renderer::State::Sampling::run(const std::function<void(int band)>& rendered) {
    if (plan_.together) s_.bands.keep_sums();
    const int size = plan_.together ? s_.bands.count : 1;
    for (first_band_ = 0; first_band_ < s_.bands.count && (first_band_ == 0 || !stopped_); first_band_ += size) {
        begin_part(1);
        std::vector<BandSamples> begun;
        for (int b = 0; b < size; ++b) begun.push_back(begin(first_band_ + b));
        for (int part = 1; part <= parts_ && !stopped_; ++part) {
            begin_part(part);
            render_part(begun);
        }
        for (BandSamples& band : begun) {
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
    band.look = first_look();
    if (plan_.sequences > 1) band.replicates.emplace(band.where, shadows_);
    if (plan_.least > 0) band.grid = blocks_in_picture(band.where);
    if (checkpoint_ && s_.inputs.merged.empty()) restore(band);
    return band;
}

void Renderer::State::Sampling::begin_part(int part) {
    part_ = part;
    own_ = parts_ > 1 ? settings_of_part(frame_, part, s_.settings.adaptive) : frame_;
    plan_ = plan_of(s_.settings, own_, s_.cache != nullptr, checkpoint_ != nullptr);
}

void Renderer::State::Sampling::render_part(std::span<BandSamples> together) {
    group_.clear();
    for (BandSamples& band : together)
        if (band.part == part_) group_.push_back(&band);
    if (group_.empty()) return;
    if (std::ranges::none_of(group_, [](const BandSamples* band) { return band->look.begun(); })) looks_[part_].clear();
    for (BandSamples* band : group_)
        if (!band->look.begun()) band->look.next = plan_.first_look;
    const auto ended = [](const BandSamples* band) { return band->look.ends; };
    if (!s_.inputs.merged.empty()) {
        for (BandSamples* band : group_) merge(*band);
    } else if (group_.size() < together.size() && !std::ranges::all_of(group_, ended)) {
        throw Error(checkpoint_->folder().string(), "has bands of other parts; --overwrite begins the picture anew");
    } else if (plan_.least > 0 && !noise_.contains(part_) && !find_noise()) {
        if (part_ > 1 || first_band_ > 0) return;
        // A picture that ends in the pilot gets one sample, and there is no plan to go on with.
        plan_ = {.samples = frame_.samples, .most = frame_.samples, .first_look = frame_.samples};
        group_.resize(1);
        group_[0]->look = first_look();
        checkpoint_ = nullptr, parts_ = 1;
        stopped_ = false;  // until that sample is there
    }
    grow();
    for (BandSamples* band : group_)
        if (parts_ > 1) end_part(*band);
}

void Renderer::State::Sampling::grow() {
    const double spent = watch_.seconds() + (checkpoint_ ? checkpoint_->earlier_seconds() : 0);
    const int groups = plan_.together ? 1 : s_.bands.count - first_band_;  // that are left
    const int turns = groups * parts_ - (part_ - 1);                       // their parts
    limit_ = own_.time_limit > 0 ? std::max((own_.time_limit - spent) / turns, 1e-9) : 0.0;
    clock_ = {}, pace_ = {};
    compiled_before_ = s_.scene.programs().compile_seconds();
    for (;;) {
        // Bands are at different places if a run was killed while it saved them.
        const auto at = [](const BandSamples* band) { return std::pair(band->look.next, band->look.each); };
        const Look ahead = (*std::ranges::max_element(group_, {}, at))->look;
        for (BandSamples* band : group_)
            while (band->look.each < ahead.next && !band->look.ends)
                if (!add_look(*band)) return;
        int chances = ahead.chances;
        const int next = next_look({.each = ahead.next, .next = ahead.next, .ends = ahead.ends}, chances);
        const bool ends = ahead.ends || next <= ahead.next;
        if (!ends && plan_.grows) looks_[part_].push_back(next);
        for (BandSamples* band : group_) {
            Look& look = band->look;
            if (!ends) look.next = next;
            look.chances = chances;  // the look that ends the part is one, too
            if (ends && !look.ends) look.ends = band->unsaved = true;
        }
        if (ends) break;
    }
    save();
    if (parts_ == 1) error_.add(group_error_);
}

bool Renderer::State::Sampling::add_look(BandSamples& band) {
    Look& look = band.look;
    while (!stopped_ && look.sequence < plan_.sequences)
        if (add_sequence(band)) ++look.sequence, look.taken = 0, look.runs = 0;
    if (stopped_) return false;
    look.each = look.next, look.sequence = 0;
    const std::vector<int>& decided = looks_[part_];
    const auto later = std::ranges::upper_bound(decided, look.each);
    if (later != decided.end()) look.next = *later;
    return true;
}

bool Renderer::State::Sampling::add_sequence(BandSamples& band) {
    Look& look = band.look;
    const SamplePoints points = s_.settings.estimator.sampler;
    const int all = plan_.least > 0 ? std::min(look.next, plan_.least) : look.next;  // samples that all pixels take
    const auto sample_at = [&](int index) { return view(band, index); };
    const std::vector<int> order =
        plan_.by_time ? order_of_samples(own_, look.each, all, sample_at) : std::vector<int>();
    while (look.each + look.taken < all) {
        const int index = look.each + look.taken;
        if (index < plan_.cached) {
            const std::uint32_t first = (s_.cache->picture() - 1) * kCachedSamples;
            add(own_, band, cached_view(own_, band.where, first, static_cast<std::uint32_t>(index), points),
                SampleKind::cached);
        } else {
            if (index > 0 && index == plan_.cached) {
                s_.in_flight->wait();
                band.with->mattes->clear();
            }
            SampleView plain = view(band, order.empty() ? index - plan_.cached : order[std::size_t(look.taken)]);
            plain.begins = index == plan_.cached && look.sequence == 0;
            add(own_, band, plain, SampleKind::plain);
        }
        ++look.taken;
        if (!go_on(band, plan_.done(look.each, look.next, look.sequence, look.taken))) return false;
    }
    if (plan_.least > 0 && !add_listed(band)) return false;
    if (band.replicates) {
        Film::Sums sums = light(band.with->sums);
        if (shadows_ != Shadows::none) sums.catchers = read(band.with->sums.catchers);
        band.replicates->add(look.sequence, sums);
    }
    return true;
}

void Renderer::State::Sampling::add(const FrameSettings& frame, BandSamples& band, const SampleView& at,
                                    SampleKind kind) {
    const std::uint64_t interrupted = interruptions();
    try {
        s_.add_sample(frame, at, *band.with, kind);
    } catch (...) {
        // The sums are those of the last sample: points of interruption precede the pass that adds to them.
        if (interruptions() != interrupted) save();
        throw;
    }
}

bool Renderer::State::Sampling::go_on(BandSamples& band, int done) {
    done_[std::size_t(band.index)] = band.earlier.samples + done;
    band.unsaved = true;
    const int of_band = plan_.sequences > 1
                            ? band.earlier.samples + plan_.expected(band.look.next) * (parts_ - part_ + 1)
                            : frame_.samples;
    std::int64_t all = std::int64_t{of_band} * (s_.bands.count - first_band_);
    for (int b = 0; b < first_band_; ++b) all += done_[std::size_t(b)];
    stopped_ = !go_on_(all);
    pace_.add(clock_.seconds(), s_.scene.programs().compile_seconds() - compiled_before_);
    if (stopped_ || (checkpoint_ && checkpoint_->due())) save();
    return !stopped_;
}

double Renderer::State::Sampling::time_left() const {
    const double overhead = pace_.overhead();
    return (limit_ - overhead) / std::max(clock_.seconds() - overhead, 1e-9);
}

int Renderer::State::Sampling::next_look(const Look& look, int& chances) {
    const auto in_time = [&](int next) {
        return limit_ > 0 ? static_cast<int>(std::min<double>(next, look.each * time_left())) : next;
    };
    if (own_.error) {
        const ErrorTarget& target = *own_.error;
        group_error_ = PictureError();
        for (const BandSamples* band : group_) add_error(*band, look.each, group_error_);
        if (look.ends) {  // `chances` of a file include this look
            group_error_.count(chances);
            return look.each;
        }
        const ErrorEstimate estimate = group_error_.judge(target.error, chances);
        if (estimate.bound <= target.error) return look.each;
        return in_time(std::min(next_replicate_samples(look.each, estimate, target.error), plan_.most));
    }
    if (look.each >= plan_.most) return look.each;
    if (plan_.grows) return in_time(std::min(2 * look.each, plan_.most));
    const int least = has_halves(s_.settings) ? 2 : 1;  // samples that the filter needs
    const bool time_is_up = limit_ > 0 && look.each >= least && !pace_.another_fits(limit_, group_.size());
    return look.each + (time_is_up ? 0 : 1);
}

void Renderer::State::Sampling::end_part(BandSamples& band) {
    if (!band.look.begun()) return;
    s_.in_flight->drain();
    PartSums& sums = band.earlier;
    sums.add(band.with->sums);
    sums.samples = done_[std::size_t(band.index)];
    if (band.replicates) sums.add(*band.replicates);
    if (plan_.least > 0) {
        const Counts picture = counts_at(band.look.each);
        sums.blocks.add(taken(band));
        sums.mattes += plan_.least * plan_.sequences;
        sums.mean += plan_.sequences * mean_of(picture);
    }
    sums.chances = std::max(sums.chances, band.look.chances - first_look().chances);
    band.look = first_look();
    if (plan_.sequences > 1) band.replicates.emplace(band.where, shadows_);
    ++band.part;
}

void Renderer::State::Sampling::finish(BandSamples& band) {
    if (parts_ > 1 && done_[std::size_t(band.index)] > 0) {
        if (band.part == part_) end_part(band);  // the callback has stopped it
        band.earlier.write(band.with->sums);
        if (frame_.error) add_error(band, 0, error_), error_.count(band.earlier.chances);
    }
    if (plan_.least > 0) scale(band);
}

}  // namespace halflight
