// Parts of the samples of a picture: their sums are kept apart and then added in order, so that the bits do not depend
// on who has rendered a part.
#include <cstring>

#include "engine/core/error.h"
#include "renderer/render_state.h"

namespace halflight {
namespace {

/// Sums of whole parts, in the order of all_of().
struct Total {
    std::array<std::vector<double>, 8> sums;
    int first_half = 0;

    void add(std::size_t i, std::span<const double> of_part) {
        std::vector<double>& sum = sums[i];
        if (sum.empty()) return sum.assign(of_part.begin(), of_part.end());
        for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += of_part[k];
    }
    void write(const std::array<gpu::Buffer*, 8>& to) const {
        for (std::size_t i = 0; i < to.size(); ++i)
            if (to[i]) to[i]->write(0, sums[i].size() * sizeof(double), sums[i].data());
    }
};

/// Returns bytes as values of type T.
template <class T>
std::vector<T> values_of(const Checkpoint::Bytes& bytes) {
    std::vector<T> values(bytes.size() / sizeof(T));
    std::memcpy(values.data(), bytes.data(), values.size() * sizeof(T));
    return values;
}

}  // namespace

int Renderer::State::render_parts(const FrameSettings& frame, const Band& where, CompiledBand& with,
                                  const AfterSample& after_sample) {
    Total total;
    int done = 0;
    for (int number = 1; number <= frame.parts; ++number) {
        const FrameSettings part = settings_of_part(frame, number);
        bool go_on = true;
        done = part.first_sample + render_band(part, where, with, 0, 0, [&](int of_part, int) {
                   return go_on = after_sample(part.first_sample + of_part, frame.samples);
               });
        in_flight->drain();
        const auto buffers = all_of(with.sums);
        for (std::size_t i = 0; i < buffers.size(); ++i)
            if (buffers[i]) total.add(i, buffers[i]->read<double>());
        total.first_half += with.sums.first_half;
        if (!go_on) break;
    }
    total.write(all_of(with.sums));
    with.sums.first_half = total.first_half;
    return done;
}

int Renderer::State::merge_parts(const FrameSettings& frame, const Band& where, CompiledBand& with) {
    executor.place(with.graphs.sample.compiled);
    const auto buffers = all_of(sums_of(with.graphs.sample, 0));
    Total total;
    std::array<std::uint64_t, kBadValueCounts> bad_values{};
    for (std::size_t k = 0; k < inputs.merged.size(); ++k) {
        const int number = static_cast<int>(k) + 1;
        const Checkpoint& from = *inputs.merged[k];
        const auto take = [&](std::size_t i, const Checkpoint::Bytes& bytes) {
            if (i >= buffers.size()) return with.mattes->add(i - buffers.size(), values_of<IdCoverage::Count>(bytes));
            if (bytes.size() != (buffers[i] ? buffers[i]->bytes() : 0))
                throw Error(from.folder().string(), "has sums of {} bytes, which do not fit the picture", bytes.size());
            if (buffers[i]) total.add(i, values_of<double>(bytes));
        };
        const auto saved = from.load(where.y, where.rows, buffers.size() + with.mattes->layers().size(), take);
        if (!saved || !saved->complete)
            throw Error(from.folder().string(), "part {} of {} is not complete", number, frame.parts);
        total.first_half += saved->first_half;
        for (std::size_t i = 0; i < std::min(bad_values.size(), saved->bad_values.size()); ++i)
            bad_values[i] += saved->bad_values[i];
    }
    total.write(buffers);
    in_flight->set_counted(bad_values);
    with.sums = sums_of(with.graphs.sample, total.first_half);
    return frame.samples;
}

}  // namespace halflight
