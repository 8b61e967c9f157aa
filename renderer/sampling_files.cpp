// Sums of samples in files: checkpoints of bands, and parts that are merged.
#include <cstring>

#include "engine/core/error.h"
#include "renderer/sampling.h"

namespace halflight {
namespace {

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

void Renderer::State::Sampling::save(const BandSamples& band) const {
    const int done = done_[std::size_t(band.index)];
    if (!checkpoint_ || done == 0) return;
    s_.in_flight->drain();
    const auto bad_values = s_.in_flight->counted().all();
    const auto buffers = band.with->sums.all();
    const auto& layers = band.with->mattes->layers();
    std::vector<Checkpoint::Bytes> of_plan;
    if (band.replicates)
        of_plan = band.replicates->state();
    else if (plan_.least > 0)
        of_plan = {bytes_of(wanted_)};
    const auto array = [&](std::size_t i) -> Checkpoint::Bytes {
        if (i < buffers.size()) return buffers[i] ? buffers[i]->read<std::byte>() : Checkpoint::Bytes();
        i -= buffers.size();
        return i < layers.size() ? bytes_of(layers[i].coverage.counts()) : of_plan[i - layers.size()];
    };
    const Look& l = band.look;
    const auto number = [](int n) { return static_cast<std::uint64_t>(n); };
    checkpoint_->save(
        {.y = band.where.y,
         .rows = band.where.rows,
         .samples = done,
         .first_half = band.with->sums.first_half,
         .complete = l.ends || (plan_.sequences == 1 && plan_.least == 0 && done >= plan_.samples),
         .bad_values = {bad_values.begin(), bad_values.end()},
         .plan = {number(l.each), number(l.next), number(l.sequence), number(l.taken), l.runs, number(l.chances)}},
        buffers.size() + layers.size() + of_plan.size(), array);
}

void Renderer::State::Sampling::restore(BandSamples& band) {
    const Checkpoint& from = *checkpoint_;
    CompiledBand& with = *band.with;
    bool fits = true;
    s_.executor.place(with.graphs.sample.compiled);
    const SumBuffers sums = s_.sums_of(with.graphs.sample, 0);
    const auto buffers = sums.all();
    const std::size_t mattes = with.mattes->layers().size();
    std::vector<Checkpoint::Bytes> of_plan;
    const auto take = [&](std::size_t i, const Checkpoint::Bytes& bytes) {
        if (i >= buffers.size() + mattes) return of_plan.push_back(bytes);
        if (i >= buffers.size()) return with.mattes->set(i - buffers.size(), values_of<IdCoverage::Count>(bytes));
        fits = fits && bytes.size() == (buffers[i] ? buffers[i]->bytes() : 0);
        if (!fits && !s_.inputs.pose)
            throw Error(from.folder().string(), "sums of {} bytes do not fit the picture", bytes.size());
        if (fits && buffers[i]) buffers[i]->write(0, bytes.size(), bytes.data());
    };
    const std::size_t arrays = band.replicates ? BandReplicates::kArrays : plan_.least > 0 ? 1 : 0;
    const auto saved = from.load(band.where.y, band.where.rows, buffers.size() + mattes + arrays, take);
    if (!saved) return;
    if (!fits) return with.mattes->clear();
    if (saved->bad_values.size() != kBadValueCounts || saved->plan.size() != 6)
        throw Error(from.folder().string(), "has {} counts of bad values and {} of the plan, not {} and 6",
                    saved->bad_values.size(), saved->plan.size(), kBadValueCounts);
    s_.in_flight->set_counted(std::span<const std::uint64_t, kBadValueCounts>(saved->bad_values));
    with.sums = sums;
    with.sums.first_half = saved->first_half;
    const auto number = [&](std::size_t i) { return static_cast<int>(saved->plan[i]); };
    band.look = {number(0), number(1), number(2), number(3), saved->plan[4], number(5), saved->complete};
    const Look& look = band.look;
    if (look.each < 0 || look.next < look.each || look.taken < 0 || look.sequence < 0 ||
        look.sequence >= plan_.sequences)
        throw Error(from.folder().string(), "its plan of samples does not fit the picture");
    // The run that saved it may have had no time limit, and then none of its looks ends early.
    if (plan_.one_by_one) band.look.next = std::min(look.next, look.each + look.taken + 1);
    band.restored = saved->complete;
    done_[std::size_t(band.index)] = saved->samples;
    if (band.replicates && !band.replicates->set(of_plan))
        throw Error(from.folder().string(), "its replicates do not fit the picture");
    if (arrays != 1) return;
    wanted_ = values_of<std::uint32_t>(of_plan[0]);
    if (band.restored) band.taken = counts_of(band, wanted_), band.uneven = true;
}

void Renderer::State::Sampling::merge(BandSamples& band) const {
    CompiledBand& with = *band.with;
    s_.executor.place(with.graphs.sample.compiled);
    SumBuffers sums = s_.sums_of(with.graphs.sample, 0);
    const auto buffers = sums.all();
    PartSums total;
    std::array<std::uint64_t, kBadValueCounts> bad_values{};
    for (std::size_t k = 0; k < s_.inputs.merged.size(); ++k) {
        const Checkpoint& from = *s_.inputs.merged[k];
        const auto take = [&](std::size_t i, const Checkpoint::Bytes& bytes) {
            if (i >= buffers.size()) return with.mattes->add(i - buffers.size(), values_of<IdCoverage::Count>(bytes));
            if (bytes.size() != (buffers[i] ? buffers[i]->bytes() : 0))
                throw Error(from.folder().string(), "has sums of {} bytes, which do not fit the picture", bytes.size());
            total.add(i, values_of<double>(bytes));
        };
        const auto saved =
            from.load(band.where.y, band.where.rows, buffers.size() + with.mattes->layers().size(), take);
        if (!saved || !saved->complete)
            throw Error(from.folder().string(), "part {} of {} is not complete", k + 1, frame_.parts);
        total.first_half += saved->first_half;
        for (std::size_t i = 0; i < std::min(bad_values.size(), saved->bad_values.size()); ++i)
            bad_values[i] += saved->bad_values[i];
    }
    total.write(sums);
    s_.in_flight->set_counted(bad_values);
    with.sums = sums;
    done_[std::size_t(band.index)] = frame_.samples;
    band.look.ends = band.restored = true;
}

}  // namespace halflight
