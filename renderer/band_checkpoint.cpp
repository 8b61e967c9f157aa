#include <cstring>

#include "engine/core/error.h"
#include "renderer/render_state.h"

namespace halflight {
void Renderer::State::save(Checkpoint& to, const Band& where, const CompiledBand& with, int done, bool complete,
                           const PlanState& plan) {
    in_flight->drain();
    const auto bad_values = in_flight->counted().all();
    const auto buffers = all_of(with.sums);
    const auto& layers = with.mattes->layers();
    const auto array = [&](std::size_t i) -> Checkpoint::Bytes {
        if (i < buffers.size()) return buffers[i] ? buffers[i]->read<std::byte>() : Checkpoint::Bytes();
        if (i >= buffers.size() + layers.size()) return plan.arrays[i - buffers.size() - layers.size()];
        const auto counts = layers[i - buffers.size()].coverage.counts();
        const auto bytes = std::as_bytes(std::span(counts));
        return {bytes.begin(), bytes.end()};
    };
    to.save({.y = where.y,
             .rows = where.rows,
             .samples = done,
             .first_half = with.sums.first_half,
             .complete = complete,
             .bad_values = {bad_values.begin(), bad_values.end()},
             .plan = plan.numbers},
            buffers.size() + layers.size() + plan.arrays.size(), array);
}

std::optional<SavedBand> Renderer::State::restore(const FrameSettings& frame, const Band& where, CompiledBand& with,
                                                  PlanState& plan) {
    const Checkpoint& from = *inputs.checkpoint;
    bool fits = true;
    executor.place(with.graphs.sample.compiled);
    const auto buffers = all_of(sums_of(with.graphs.sample, 0));
    const auto take = [&](std::size_t i, const Checkpoint::Bytes& bytes) {
        if (i < buffers.size()) {
            fits = fits && bytes.size() == (buffers[i] ? buffers[i]->bytes() : 0);
            if (!fits && inputs.pose) return;
            if (!fits) throw Error(from.folder().string(), "sums of {} bytes do not fit the picture", bytes.size());
            if (buffers[i]) buffers[i]->write(0, bytes.size(), bytes.data());
        } else if (i >= buffers.size() + with.mattes->layers().size()) {
            plan.arrays.push_back(bytes);
        } else {
            std::vector<IdCoverage::Count> counts(bytes.size() / sizeof(IdCoverage::Count));
            std::memcpy(counts.data(), bytes.data(), counts.size() * sizeof(IdCoverage::Count));
            with.mattes->set(i - buffers.size(), counts);
        }
    };
    plan = {};
    const std::size_t of_plan = frame.error ? BandReplicates::kArrays : settings.adaptive ? 1 : 0;
    std::optional<SavedBand> saved =
        from.load(where.y, where.rows, buffers.size() + with.mattes->layers().size() + of_plan, take);
    if (!saved) return saved;
    if (!fits) {
        with.mattes->clear();
        return std::nullopt;
    }
    if (saved->bad_values.size() != kBadValueCounts)
        throw Error(from.folder().string(), "has {} counts of bad values, not {}", saved->bad_values.size(),
                    kBadValueCounts);
    in_flight->set_counted(std::span<const std::uint64_t, kBadValueCounts>(saved->bad_values));
    with.sums = sums_of(with.graphs.sample, saved->first_half);
    plan.numbers = saved->plan;
    return saved;
}

std::vector<std::uint32_t> Renderer::State::saved_plan(const FrameSettings& frame) {
    PlanState plan;
    for (int b = 0; b < bands && plan.arrays.empty(); ++b) restore(frame, band_at(b), compiled(b), plan);
    if (plan.arrays.empty()) return {};
    std::vector<std::uint32_t> counts(plan.arrays[0].size() / sizeof(std::uint32_t));
    std::memcpy(counts.data(), plan.arrays[0].data(), plan.arrays[0].size());
    return counts;
}

}  // namespace halflight
