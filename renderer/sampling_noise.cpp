// Adaptive sampling (passes/picture/adaptive.h): a pilot decides the shares of the blocks and is thrown away. With an
// error target, all replicates of a block then take the same number of samples, so they are independent and distributed
// alike, as ReplicateError demands. All bands grow together until the picture meets the error, so that it does not
// depend on them.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "passes/picture/adaptive.h"
#include "renderer/sampling.h"
#include "shaders/shared/sobol.h"

namespace halflight {
namespace {

using shared::SampledBlock;

double mean_of(const std::vector<std::uint32_t>& counts) {
    return static_cast<double>(std::accumulate(counts.begin(), counts.end(), std::uint64_t{0})) /
           static_cast<double>(counts.size());
}

ivec2 blocks_of(const RenderSettings& settings) {
    return (ivec2(settings.width, settings.height) + 15) / 16;
}

}  // namespace

bool Renderer::State::Sampling::find_noise() {
    const ivec2 blocks = blocks_of(s_.settings);
    if (!frame_.error) {
        for (int b = 0; checkpoint_ && b < s_.bands.count && wanted_.empty(); ++b)
            begin(b);  // a band's checkpoint has them
        std::ranges::fill(done_, 0);
        if (!wanted_.empty()) return true;
        const std::vector<float> errors = pilot_errors(0, pilot_samples(frame_.samples), ErrorMetric::relmse);
        if (!errors.empty())
            wanted_ = adaptive_counts(errors, blocks, static_cast<std::uint32_t>(plan_.least),
                                      errors.size() * static_cast<std::uint64_t>(frame_.samples));
        return !errors.empty();
    }
    const int first = pilot_samples(0);
    std::vector<float> errors = pilot_errors(0, first, frame_.error->metric);
    if (errors.empty()) return false;
    deviations_ = block_deviations(errors, blocks);
    // Sequences converge faster than independent samples, of which fewer than half are needed in most pictures.
    const int pilot = pilot_samples(std::min(frame_.samples, expected_samples(deviations_, frame_.error->error) / 2));
    if (pilot == first) return true;
    errors = pilot_errors(first, pilot, frame_.error->metric);
    if (!errors.empty()) deviations_ = block_deviations(errors, blocks);
    return !errors.empty();
}

std::vector<float> Renderer::State::Sampling::pilot_errors(int from, int to, ErrorMetric metric) {
    const ivec2 blocks = blocks_of(s_.settings);
    std::vector<float> errors(static_cast<std::size_t>(blocks.x) * static_cast<std::size_t>(blocks.y));
    FrameSettings pilots = frame_;
    pilots.seed = shared::hash_combine(shared::hash_u32(frame_.seed), 0x70696c6f);
    for (int b = 0; b < s_.bands.count; ++b) {
        const Band where = s_.bands.at(b);
        CompiledBand& with = s_.compiled(b);
        for (int done = from; done < to; ++done) {
            const SampleView sample =
                sample_view(pilots, where, static_cast<std::uint32_t>(done), s_.settings.estimator.sampler);
            s_.add_sample(pilots, sample, with, SampleKind::pilot);
            stopped_ = !go_on_(std::int64_t{plan_.expected(plan_.first_look)} * s_.bands.count);
            if (stopped_) return {};
        }
        graph::Graph graph;
        const graph::BufferHandle read =
            add_block_errors(graph, s_.bands.first, imported(graph, with.sums), to, metric);
        graph.output(read);
        s_.composer.run(graph::compile(graph));
        const std::vector<float> of_band = s_.composer.read<float>(read);
        const std::vector<std::size_t> grid = blocks_in_picture(where);
        for (std::size_t i = 0; i < grid.size(); ++i)
            if (grid[i] < errors.size()) errors[grid[i]] = of_band[i];
    }
    return errors;
}

auto Renderer::State::Sampling::counts_of(const BandSamples& band, const Counts& picture) const -> Counts {
    Counts counts;
    for (const std::size_t place : band.grid)
        counts.push_back(place < picture.size() ? picture[place] : static_cast<std::uint32_t>(plan_.least));
    return counts;
}

bool Renderer::State::Sampling::add_listed(BandSamples& band, const ListedSamples::SampleOf& sample_of) {
    Look& look = band.look;
    band.uneven = band.uneven || look.next > plan_.least;
    const auto least = static_cast<std::uint32_t>(plan_.least);
    const Counts from = look.each == 0 ? Counts(band.grid.size(), least) : counts_of(band, counts_);
    ListedSamples listed(from, counts_of(band, wanted_), sample_of);
    const auto all = static_cast<double>(listed.left());
    for (std::uint64_t run = 0; run < look.runs && !listed.done(); ++run) listed.next_run();  // an earlier run's
    SampleView sample = sample_of(least);  // any of them; all have its seed
    sample.begins = false;
    const int before = plan_.done(look.each, look.next, look.sequence, look.taken);
    bool go = true;
    while (go && !listed.done()) {
        sample.at = listed.at();
        const std::vector<SampledBlock> entries = listed.next_run();
        s_.sample.blocks->write(std::span<const SampledBlock>(entries));
        add(band, frame_, sample, SampleKind::listed);
        ++look.runs;
        const double share = 1 - static_cast<double>(listed.left()) / all;
        go = go_on(band, before + static_cast<int>(share * (look.next - look.each - look.taken)));
    }
    std::uint32_t halves = 0;  // samples of the first half among those that all pixels took
    for (std::uint32_t i = 0; look.each == 0 && i < least; ++i) halves += sample_of(i).first_half ? 1 : 0;
    for (std::size_t i = 0; i < band.taken.size(); ++i) {
        band.taken[i] += listed.taken()[i] - (look.each == 0 ? 0 : from[i]);
        band.first_halves[i] += listed.first_halves()[i] + halves;
    }
    return go;
}

void Renderer::State::Sampling::scale(BandSamples& band) {
    CompiledBand& with = *band.with;
    with.samples = band.taken;
    with.first_samples = plan_.least * plan_.sequences;
    int wanted = frame_.samples / 2 * 2;  // both halves stand for as many
    if (frame_.error) {
        const double mean = stopped_ ? mean_of(with.samples) : plan_.sequences * mean_of(counts_);
        wanted = 2 * static_cast<int>(std::lround(mean / 2));
    }
    done_[std::size_t(band.index)] = wanted;
    if (band.restored) return;  // scaled by the earlier run
    gpu::Buffer counts = gpu::Buffer::from("numbers of samples", with.samples);
    gpu::Buffer first = gpu::Buffer::from("samples of the first half", band.first_halves);
    graph::Graph graph;
    const auto doubles = [&](const gpu::Buffer* b) {
        return b ? b->bytes() / sizeof(double) / s_.bands.first.paths() : 0;
    };
    add_adaptive_mean(
        graph, s_.bands.first, imported(graph, with.sums),
        {graph.import_buffer("numbers of samples", counts), graph.import_buffer("samples of the first half", first)},
        static_cast<std::uint32_t>(wanted), doubles(with.sums.halves), doubles(with.sums.groups));
    s_.composer.run(graph::compile(graph));
    with.sums.first_half = wanted / 2;
}

}  // namespace halflight
