#include "renderer/hand_over.h"

#include <algorithm>

#include "shaders/shared/sobol.h"

namespace halflight {
namespace {

using graph::Access;

constexpr std::size_t kMostGroups = 65535;  // work groups that every driver allows

/// A mean with its weight.
struct Part {
    const SumBuffers& sums;
    int samples;
    double weight;
};

void add_blend(graph::Graph& graph, gpu::Buffer& cached, float cached_weight, gpu::Buffer& others, float weight,
               gpu::Buffer& to) {
    graph::Pass pass = graph.add_pass("hand over");
    pass.read(graph.import_buffer("cached sums", cached), Access::storage_read, "Biased");
    pass.read(graph.import_buffer("sums", others), Access::storage_read, "Unbiased");
    const graph::BufferHandle both = pass.write(graph.import_buffer("blended sums", to), Access::storage_write, "Both");
    const std::size_t values = to.bytes() / sizeof(double);
    pass.kernel({"shaders/hand_over.comp"});
    pass.execute([=](graph::Resources& r) {
        const gpu::Program& program = r.kernel();
        program.set("weight_biased", cached_weight);
        program.set("weight_unbiased", weight);
        program.set("values", static_cast<std::uint32_t>(values));
        program.dispatch(static_cast<std::uint32_t>(std::min<std::size_t>((values + 63) / 64, kMostGroups)));
    });
    graph.output(both);
}

/// Returns sums of the picture; element 3 * path + channel.
std::vector<double> beauty_sums(const SumBuffers& sums) {
    const auto emission = sums.emission->read<double>();
    std::vector<double> all(emission.size() / 4 * 3);
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = emission[i / 3 * 4 + i % 3];
    for (const gpu::Buffer* light : {sums.direct, sums.indirect}) {
        if (!light) continue;
        const auto both = light->read<double>();
        for (std::size_t i = 0; i < all.size(); ++i) all[i] += both[i / 3 * 6 + i % 3] + both[i / 3 * 6 + 3 + i % 3];
    }
    return all;
}

/// Returns squares that give the variance of the weighted mean. Variances of independent parts add. samples: sum over
/// the parts.
std::vector<double> squares_of(const Part (&parts)[2], const SumBuffers& blended, int samples) {
    std::vector<double> squares = beauty_sums(blended);
    for (double& s : squares) s *= s / samples;
    for (const Part& part : parts) {
        if (part.samples < 2) continue;
        const double n = part.samples;
        const std::vector<double> sums = beauty_sums(part.sums), own = part.sums.squares->read<double>();
        for (std::size_t i = 0; i < squares.size(); ++i) {
            const double variance = std::max(own[i] - sums[i] * sums[i] / n, 0.0) / (n - 1) / n;
            squares[i] += part.weight * part.weight * variance * samples * (samples - 1.0);
        }
    }
    return squares;
}

}  // namespace

Accumulated imported(graph::Graph& graph, const SumBuffers& sums) {
    const auto import = [&](gpu::Buffer* b) { return b ? graph.import_buffer("sums", *b) : graph::BufferHandle{}; };
    Accumulated all;
    all.emission = import(sums.emission), all.direct = import(sums.direct), all.indirect = import(sums.indirect);
    all.squares = import(sums.squares), all.features = import(sums.features), all.halves = import(sums.halves);
    all.groups = import(sums.groups), all.catchers = import(sums.catchers);
    return all;
}

double cached_weight(int samples) {
    constexpr double kOthers = kHandedOver - kCachedSamples;
    const double x = std::clamp((samples - kCachedSamples) / kOthers, 0.0, 1.0);
    return (1 - x) / (1 + x);
}

SampleView cached_view(const FrameSettings& frame, const Band& band, std::uint32_t first, std::uint32_t index,
                       SamplePoints points) {
    constexpr std::uint32_t kCached = 0x63616368;
    FrameSettings own = frame;
    own.seed = shared::hash_combine(shared::hash_u32(frame.seed), kCached);
    SampleView view = sample_view(own, band, first + index, points);
    view.begins = index == 0;
    view.first_half = in_first_half(index);
    return view;
}

ShownSums HandOver::shown(graph::Executor& executor, const SumBuffers* cached, const SumBuffers& others, int done) {
    const int first = cached ? std::min(done, kCachedSamples) : 0, later = done - first;
    if (first > 0 && later == 0) return {*cached, first, first, double(cached->first_half)};
    const double weight = cached_weight(done);
    if (first == 0 || weight == 0) return {others, later, later, double(others.first_half)};
    const double half = done * (weight * cached->first_half / first + (1 - weight) * others.first_half / later);
    return {blend(executor, *cached, first, others, later), done, later, half};
}

SumBuffers HandOver::blend(graph::Executor& executor, const SumBuffers& cached, int cached_samples,
                           const SumBuffers& others, int samples) {
    constexpr gpu::Buffer* SumBuffers::*kSums[] = {&SumBuffers::emission, &SumBuffers::direct,  &SumBuffers::indirect,
                                                   &SumBuffers::features, &SumBuffers::squares, &SumBuffers::halves,
                                                   &SumBuffers::catchers};
    const int all = cached_samples + samples;
    const double weight = cached_weight(all);
    graph::Graph graph;
    SumBuffers blended;
    for (std::size_t i = 0; i < blended_.size(); ++i) {
        const auto sums = kSums[i];
        if (!(others.*sums)) continue;
        std::optional<gpu::Buffer>& to = blended_[i];
        if (!to || to->bytes() != (others.*sums)->bytes()) to.emplace("blended sums", (others.*sums)->bytes());
        blended.*sums = &*to;
        if (sums == &SumBuffers::squares) continue;
        add_blend(graph, *(cached.*sums), static_cast<float>(weight * all / cached_samples), *(others.*sums),
                  static_cast<float>((1 - weight) * all / samples), *to);
    }
    executor.run(graph::compile(graph));
    if (blended.squares) {
        const std::vector<double> squares =
            squares_of({{cached, cached_samples, weight}, {others, samples, 1 - weight}}, blended, all);
        blended.squares->write(std::span<const double>(squares));
    }
    return blended;
}

}  // namespace halflight
