#include <cstring>

#include "engine/core/error.h"
#include "renderer/render_state.h"

namespace halflight {
void Renderer::State::save(Checkpoint& to, const Band& where, const CompiledBand& with, int done, bool complete) {
    in_flight->drain();
    const auto bad_values = in_flight->counted().all();
    const auto buffers = all_of(with.sample.sums);
    const auto& layers = with.mattes->layers();
    const auto array = [&](std::size_t i) -> Checkpoint::Bytes {
        if (i < buffers.size()) return buffers[i] ? buffers[i]->read<std::byte>() : Checkpoint::Bytes();
        const auto counts = layers[i - buffers.size()].coverage.counts();
        const auto bytes = std::as_bytes(std::span(counts));
        return {bytes.begin(), bytes.end()};
    };
    to.save({.y = where.y,
             .rows = where.rows,
             .samples = done,
             .first_half = with.sample.sums.first_half,
             .complete = complete,
             .bad_values = {bad_values.begin(), bad_values.end()}},
            buffers.size() + layers.size(), array);
}

std::optional<SavedBand> Renderer::State::restore(const FrameSettings& frame, const Band& where, CompiledBand& with) {
    const Checkpoint& from = *frame.checkpoint;
    bool fits = true;
    executor.place(with.sample.compiled);
    const auto buffers = all_of(sums_of(with.sample, 0));
    const auto take = [&](std::size_t i, const Checkpoint::Bytes& bytes) {
        if (i < buffers.size()) {
            fits = fits && bytes.size() == (buffers[i] ? buffers[i]->bytes() : 0);
            if (!fits && frame.shutter) return;
            if (!fits) throw Error(from.folder().string(), "sums of {} bytes do not fit the picture", bytes.size());
            if (buffers[i]) buffers[i]->write(0, bytes.size(), bytes.data());
        } else {
            std::vector<IdCoverage::Count> counts(bytes.size() / sizeof(IdCoverage::Count));
            std::memcpy(counts.data(), bytes.data(), counts.size() * sizeof(IdCoverage::Count));
            with.mattes->set(i - buffers.size(), counts);
        }
    };
    std::optional<SavedBand> saved =
        from.load(where.y, where.rows, buffers.size() + with.mattes->layers().size(), take);
    if (!saved) return saved;
    if (!fits) {
        with.mattes->clear();
        return std::nullopt;
    }
    if (saved->bad_values.size() != kBadValueCounts)
        throw Error(from.folder().string(), "has {} counts of bad values, not {}", saved->bad_values.size(),
                    kBadValueCounts);
    in_flight->set_counted(std::span<const std::uint64_t, kBadValueCounts>(saved->bad_values));
    with.sample.sums = sums_of(with.sample, saved->first_half);
    return saved;
}

}  // namespace halflight
