// Adaptive sampling of a picture with a given number of samples (passes/picture/adaptive.h).
#include <algorithm>
#include <utility>

#include "engine/core/interruption.h"
#include "passes/picture/adaptive.h"
#include "renderer/listed_samples.h"
#include "renderer/render_state.h"
#include "shaders/shared/pixel_order.h"
#include "shaders/shared/sobol.h"

namespace halflight {
namespace {

using shared::SampledBlock;

Accumulated imported(graph::Graph& graph, const SumBuffers& sums) {
    const auto import = [&](gpu::Buffer* b) { return b ? graph.import_buffer("sums", *b) : graph::BufferHandle{}; };
    Accumulated all;
    all.emission = import(sums.emission), all.direct = import(sums.direct), all.indirect = import(sums.indirect);
    all.squares = import(sums.squares), all.features = import(sums.features), all.halves = import(sums.halves);
    all.groups = import(sums.groups);
    return all;
}

/// Leaves mattes out of the samples that are made during its lifetime.
class WithoutMattes {
  public:
    explicit WithoutMattes(bool& adds_mattes) : adds_mattes_(adds_mattes), before_(std::exchange(adds_mattes, false)) {}
    WithoutMattes(const WithoutMattes&) = delete;
    WithoutMattes& operator=(const WithoutMattes&) = delete;
    ~WithoutMattes() { adds_mattes_ = before_; }

  private:
    bool& adds_mattes_;
    bool before_;
};

}  // namespace

ivec2 Renderer::State::picture_blocks() const {
    return (ivec2(settings.width, settings.height) + 15) / 16;
}

std::vector<std::size_t> Renderer::State::blocks_in_picture(const Band& where) {
    std::vector<std::size_t> blocks;
    const uvec2 tiles = where.tiles();
    for (std::uint32_t path = 0; path < where.paths(); path += 256) {
        const uvec2 pixel = shared::pixel_of_path(path, tiles) + uvec2(0, static_cast<std::uint32_t>(where.y));
        blocks.push_back(std::size_t{pixel.y / 16} * tiles.x + pixel.x / 16);
    }
    return blocks;
}

std::vector<float> Renderer::State::pilot_errors(const FrameSettings& frame, int from, int to, ErrorMetric metric,
                                                 const std::function<bool()>& after_sample) {
    const ivec2 blocks = picture_blocks();
    std::vector<float> errors(static_cast<std::size_t>(blocks.x) * static_cast<std::size_t>(blocks.y));
    FrameSettings pilots = frame;
    pilots.seed = shared::hash_combine(shared::hash_u32(frame.seed), 0x70696c6f);
    bool stopped = false;
    for (int b = 0; b < bands; ++b) {
        const Band where = band_at(b);
        CompiledBand& with = compiled(b);
        {
            const WithoutMattes without(with.sample.adds_mattes);
            for (int done = from; done < to && !stopped; ++done) {
                const auto sample = static_cast<std::uint32_t>(done);
                add_sample(pilots, sample_view(pilots, where, sample, settings.estimator.sampler), with, with.sample);
                stopped = !after_sample();
            }
        }
        if (stopped) return {};
        graph::Graph graph;
        const graph::BufferHandle read = add_block_errors(graph, band, imported(graph, with.sample.sums), to, metric);
        graph.output(read);
        composer.run(graph::compile(graph));
        const std::vector<float> of_band = composer.read<float>(read);
        const std::vector<std::size_t> grid = blocks_in_picture(where);
        for (std::size_t i = 0; i < grid.size(); ++i)
            if (grid[i] < errors.size()) errors[grid[i]] = of_band[i];
    }
    return errors;
}

std::vector<std::uint32_t> Renderer::State::plan_samples(const FrameSettings& frame,
                                                         const std::function<bool()>& after_sample) {
    const std::vector<float> errors =
        pilot_errors(frame, 0, pilot_samples(frame.samples), ErrorMetric::relmse, after_sample);
    if (errors.empty()) return {};
    return adaptive_counts(errors, picture_blocks(), static_cast<std::uint32_t>(least_samples(frame.samples)),
                           errors.size() * static_cast<std::uint64_t>(frame.samples));
}

bool Renderer::State::add_listed(const FrameSettings& frame, SampleView sample, CompiledBand& with,
                                 ListedSamples& listed, const std::function<bool(double share)>& after_run) {
    const auto all = static_cast<double>(listed.left());
    sample.begins = false;
    bool go_on = true;
    while (go_on && !listed.done()) {
        sample.at = listed.at();
        const std::vector<SampledBlock> entries = listed.next_run();
        sampled_blocks->write(std::span<const SampledBlock>(entries));
        add_sample(frame, sample, with, *with.listed);
        go_on = after_run(1 - static_cast<double>(listed.left()) / all);
    }
    return go_on;
}

void Renderer::State::scale_sums(CompiledBand& with, std::span<const std::uint32_t> first_halves, int wanted) {
    gpu::Buffer counts = gpu::Buffer::from("numbers of samples", with.samples);
    gpu::Buffer first = gpu::Buffer::from("samples of the first half",
                                          std::vector<std::uint32_t>(first_halves.begin(), first_halves.end()));
    graph::Graph graph;
    const auto doubles = [&](const gpu::Buffer* b) { return b ? b->bytes() / sizeof(double) / band.paths() : 0; };
    add_adaptive_mean(
        graph, band, imported(graph, with.sample.sums),
        {graph.import_buffer("numbers of samples", counts), graph.import_buffer("samples of the first half", first)},
        static_cast<std::uint32_t>(wanted), doubles(with.sample.sums.halves), doubles(with.sample.sums.groups));
    composer.run(graph::compile(graph));
    with.sample.sums.first_half = wanted / 2;
}

int Renderer::State::render_band_adaptively(const FrameSettings& frame, const Band& where, CompiledBand& with,
                                            const std::vector<std::uint32_t>& plan, const AfterSample& after_sample,
                                            const PlanState& state) {
    const auto sample_of = [&](std::uint32_t number) {
        return sample_view(frame, where, number, settings.estimator.sampler);
    };
    const int least = least_samples(frame.samples);
    const auto from = static_cast<std::uint32_t>(least);
    with.samples.clear();
    with.first_samples = least;
    // Samples that all pixels have, runs of listed blocks after them, and whether the sums are scaled.
    std::uint64_t first = 0, runs = 0;
    bool complete = false;
    if (state.numbers.size() == 3) first = state.numbers[0], runs = state.numbers[1], complete = state.numbers[2] > 0;
    const auto save_band = [&](int done) {
        if (!inputs.checkpoint || done == 0) return;
        const auto bytes = std::as_bytes(std::span(plan));
        save(*inputs.checkpoint, where, with, done, complete,
             {{first, runs, complete ? 1u : 0u}, {{bytes.begin(), bytes.end()}}});
    };
    const auto guarded = [&](const auto& add) {
        const std::uint64_t interrupted = interruptions();
        try {
            return add();
        } catch (...) {
            if (interruptions() != interrupted) save_band(static_cast<int>(first));
            throw;
        }
    };
    const auto due = [&](bool go_on) { return !go_on || (inputs.checkpoint && inputs.checkpoint->due()); };
    while (first < from) {
        guarded([&] { add_sample(frame, sample_of(static_cast<std::uint32_t>(first)), with, with.sample); });
        const int done = static_cast<int>(++first);
        const bool go_on = after_sample(done, frame.samples);
        if (due(go_on)) save_band(done);
        if (!go_on) return with.first_samples = done;
    }

    std::vector<std::uint32_t> counts;
    for (const std::size_t place : blocks_in_picture(where)) counts.push_back(place < plan.size() ? plan[place] : from);
    const int wanted = frame.samples / 2 * 2;  // both halves stand for as many
    if (complete) {
        with.samples = counts;
        return wanted;
    }
    ListedSamples listed(std::vector<std::uint32_t>(counts.size(), from), counts, sample_of);
    for (std::uint64_t run = 0; run < runs && !listed.done(); ++run) listed.next_run();  // an earlier run has made it
    guarded([&] {
        return add_listed(frame, sample_of(from), with, listed, [&](double share) {
            ++runs;
            const int done = least + static_cast<int>(share * (frame.samples - least));
            const bool go_on = after_sample(done, frame.samples);
            if (due(go_on) && !listed.done()) save_band(done);
            return go_on;
        });
    });

    with.samples = listed.taken();
    std::uint32_t of_first = 0;  // samples of the first half among those that all pixels have
    for (std::uint32_t number = 0; number < from; ++number) of_first += sample_of(number).first_half ? 1 : 0;
    std::vector<std::uint32_t> first_halves = listed.first_halves();
    for (std::uint32_t& half : first_halves) half += of_first;
    complete = with.samples == counts;
    scale_sums(with, first_halves, wanted);
    if (complete) save_band(wanted);
    return wanted;
}

}  // namespace halflight
