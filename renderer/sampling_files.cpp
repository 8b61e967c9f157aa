// Sums of samples in files: checkpoints of bands, and parts that are merged.
#include <algorithm>
#include <bit>
#include <cstring>
#include <functional>
#include <iterator>
#include <utility>

#include "engine/core/error.h"
#include "renderer/sampling.h"

namespace halflight {
namespace {

constexpr std::size_t kPlanNumbers = 13;  // of SavedBand::plan, before the looks

using BadValueNumbers = std::array<std::uint64_t, kBadValueCounts>;

/// Returns the larger numbers of two. Each band is saved with the counts of the picture so far.
BadValueNumbers most(std::span<const std::uint64_t> one, std::span<const std::uint64_t> other) {
    BadValueNumbers larger{};
    std::ranges::transform(one, other, larger.begin(), [](std::uint64_t a, std::uint64_t b) { return std::max(a, b); });
    return larger;
}

/// Returns bytes as values of type T.
template <class T>
std::vector<T> values_of(const Checkpoint::Bytes& bytes) {
    std::vector<T> values(bytes.size() / sizeof(T));
    std::memcpy(values.data(), bytes.data(), values.size() * sizeof(T));
    return values;
}

template <class T>
Checkpoint::Bytes bytes_of(const std::vector<T>& values) {
    const auto bytes = std::as_bytes(std::span(values));
    return {bytes.begin(), bytes.end()};
}

}  // namespace

void Renderer::State::Sampling::save() {
    for (BandSamples* band : group_)
        if (band->unsaved) save(*band);
}

void Renderer::State::Sampling::save(BandSamples& band) const {
    const int done = done_[std::size_t(band.index)];
    if (!checkpoint_ || done == 0) return;
    s_.in_flight->drain();
    const auto bad_values = s_.in_flight->counted().all();
    const auto buffers = band.with->sums.all();
    const auto& layers = band.with->mattes->layers();
    std::vector<Checkpoint::Bytes> of_plan;
    const auto append = [&](std::vector<Checkpoint::Bytes> arrays) {
        std::ranges::move(arrays, std::back_inserter(of_plan));
    };
    if (band.replicates) append(band.replicates->state());
    if (plan_.least > 0) {
        const Noise& noise = noise_.at(part_);
        of_plan.push_back(plan_.grows ? bytes_of(noise.deviations) : bytes_of(noise.wanted));
    }
    const PartSums& earlier = band.earlier;
    if (band.part > 1) {
        for (const auto& sums : earlier.sums) of_plan.push_back(bytes_of(sums));
        append({bytes_of(earlier.blocks.all), bytes_of(earlier.blocks.first_half)});
        if (earlier.replicates) append(earlier.replicates->state());
    }
    const auto array = [&](std::size_t i) -> Checkpoint::Bytes {
        if (i < buffers.size()) return buffers[i] ? buffers[i]->read<std::byte>() : Checkpoint::Bytes();
        i -= buffers.size();
        return i < layers.size() ? bytes_of(layers[i].coverage.counts()) : of_plan[i - layers.size()];
    };
    const Look& l = band.look;
    const auto number = [](int n) { return static_cast<std::uint64_t>(n); };
    SavedBand saved{.y = band.where.y,
                    .rows = band.where.rows,
                    .samples = done,
                    .first_half = band.with->sums.first_half,
                    .complete = band.part == parts_ && (l.ends || (plan_.sequences == 1 && plan_.least == 0 &&
                                                                   l.each + l.taken >= plan_.samples)),
                    .bad_values = {bad_values.begin(), bad_values.end()}};
    saved.plan = {number(band.part),          number(l.each),         number(l.next),
                  number(l.sequence),         number(l.taken),        l.runs,
                  number(l.chances),          number(l.ends ? 1 : 0), number(earlier.samples),
                  number(earlier.first_half), number(earlier.mattes), std::bit_cast<std::uint64_t>(earlier.mean),
                  number(earlier.chances)};
    if (const auto looks = looks_.find(band.part); looks != looks_.end())
        for (const int look : looks->second) saved.plan.push_back(number(look));
    checkpoint_->save(saved, buffers.size() + layers.size() + of_plan.size(), array);
    band.unsaved = false;
}

std::optional<SavedBand> Renderer::State::Sampling::load(BandSamples& band, const Checkpoint& from) {
    const auto name = from.folder().string();
    CompiledBand& with = *band.with;
    bool fits = true;
    s_.executor.place(with.graphs.sample.compiled);
    const SumBuffers sums = s_.sums_of(with.graphs.sample, 0);
    const auto buffers = sums.all();
    const std::size_t mattes = with.mattes->layers().size();
    std::vector<Checkpoint::Bytes> of_plan;
    const auto take = [&](std::size_t i, const Checkpoint::Bytes& bytes) {
        if (i >= buffers.size() + mattes) return of_plan.push_back(bytes);
        if (i >= buffers.size()) return with.mattes->add(i - buffers.size(), values_of<IdCoverage::Count>(bytes));
        fits = fits && bytes.size() == (buffers[i] ? buffers[i]->bytes() : 0);
        if (!fits && (!s_.inputs.pose || !s_.inputs.merged.empty()))
            throw Error(name, "sums of {} bytes do not fit the picture", bytes.size());
        if (fits && buffers[i]) buffers[i]->write(0, bytes.size(), bytes.data());
    };
    const std::size_t of_replicates = band.replicates ? BandReplicates::kArrays : 0;
    const std::size_t of_part = of_replicates + (plan_.least > 0 ? 1 : 0);
    const auto arrays = [&](const SavedBand& head) {
        if (head.bad_values.size() != kBadValueCounts || head.plan.size() < kPlanNumbers)
            throw Error(name, "has {} counts of bad values and {} of the plan", head.bad_values.size(),
                        head.plan.size());
        const std::size_t of_earlier = head.plan[0] > 1 ? buffers.size() + 2 + of_replicates : 0;
        return buffers.size() + mattes + of_part + of_earlier;
    };
    auto saved = from.load(band.where.y, band.where.rows, arrays, take);
    if (!saved) return std::nullopt;
    if (!fits) {
        with.mattes->clear();
        return std::nullopt;
    }
    const auto number = [&](std::size_t i) { return static_cast<int>(saved->plan[i]); };
    const auto check = [&](bool good) {
        if (!good) throw Error(name, "its plan of samples does not fit the picture");
    };
    band.part = number(0);
    band.look = {number(1), number(2), number(3), number(4), saved->plan[5], number(6), number(7) != 0};
    const Look& look = band.look;
    check(look.each >= 0 && look.next >= look.each && look.taken >= 0 && look.sequence >= 0 &&
          look.sequence < plan_.sequences && band.part >= 1 && band.part <= std::max(parts_, frame_.parts));
    with.sums = sums;
    with.sums.first_half = saved->first_half;
    const std::span<const Checkpoint::Bytes> all(of_plan);
    check(!band.replicates || band.replicates->set(all.first(of_replicates)));
    if (plan_.least > 0) {
        Noise& noise = noise_[s_.inputs.merged.empty() ? band.part : part_];
        if (plan_.grows)
            noise.deviations = values_of<double>(all[of_replicates]);
        else
            noise.wanted = values_of<std::uint32_t>(all[of_replicates]);
    }
    if (band.part > 1 && all.size() > of_part) {
        PartSums& earlier = band.earlier;
        const auto of_earlier = all.subspan(of_part);
        for (std::size_t i = 0; i < buffers.size(); ++i) {
            check(of_earlier[i].size() == (buffers[i] ? buffers[i]->bytes() : 0));
            earlier.sums[i] = values_of<double>(of_earlier[i]);
        }
        earlier.blocks = {values_of<std::uint32_t>(of_earlier[buffers.size()]),
                          values_of<std::uint32_t>(of_earlier[buffers.size() + 1])};
        check(earlier.blocks.all.size() == band.grid.size() && earlier.blocks.first_half.size() == band.grid.size());
        earlier.samples = number(8), earlier.first_half = number(9), earlier.mattes = number(10);
        earlier.mean = std::bit_cast<double>(saved->plan[11]), earlier.chances = number(12);
        if (of_replicates > 0) {
            earlier.replicates.emplace(band.where, shadows_);
            check(earlier.replicates->set(of_earlier.last(of_replicates)));
        }
    }
    return saved;
}

void Renderer::State::Sampling::restore(BandSamples& band) {
    const auto saved = load(band, *checkpoint_);
    if (!saved) return;
    s_.in_flight->set_counted(most(s_.in_flight->counted().all(), saved->bad_values));
    // The run that saved it may have had no time limit, and then none of its looks ends early.
    Look& look = band.look;
    if (plan_.one_by_one && !look.ends) look.next = std::min(look.next, look.each + look.taken + 1);
    std::vector<int> looks;
    for (std::size_t i = kPlanNumbers; i < saved->plan.size(); ++i) looks.push_back(static_cast<int>(saved->plan[i]));
    if (looks.size() > looks_[band.part].size()) looks_[band.part] = looks;
    done_[std::size_t(band.index)] = saved->samples;
}

void Renderer::State::Sampling::merge(BandSamples& band) {
    const Checkpoint& from = *s_.inputs.merged[std::size_t(part_ - 1)];
    const auto saved = load(band, from);
    if (!saved || !saved->complete)
        throw Error(from.folder().string(), "part {} of {} is not complete", part_, frame_.parts);
    bad_values_[part_] = most(bad_values_[part_], saved->bad_values);
    BadValueNumbers all{};
    for (const auto& [part, numbers] : bad_values_) std::ranges::transform(all, numbers, all.begin(), std::plus<>());
    s_.in_flight->set_counted(all);
    band.part = part_, band.look.ends = true;
    done_[std::size_t(band.index)] = band.earlier.samples + saved->samples;
}

}  // namespace halflight
