// Adaptive sampling of a band (passes/picture/adaptive.h).
#include <algorithm>
#include <numeric>

#include "passes/picture/adaptive.h"
#include "renderer/render_state.h"
#include "shaders/shared/pixel_order.h"
#include "shaders/shared/sampled_block.h"
#include "shaders/shared/sobol.h"

namespace halflight {
namespace {

using shared::SampledBlock;

/// The samples of listed blocks, a run at a time. Blocks come in the order of their paths,
/// so that the samples of one block follow each other.
class ListedSamples {
  public:
    /// counts: samples of each block, in the order of paths. samples: those that each block takes in turn, as many as
    /// the largest count.
    ListedSamples(std::vector<std::uint32_t> counts, std::vector<SampleView> samples)
        : counts_(std::move(counts)), samples_(std::move(samples)), taken_(counts_.size()) {}

    bool done() const { return block_ == counts_.size(); }
    /// Returns the number of samples that each block has in the runs so far.
    const std::vector<std::uint32_t>& taken() const { return taken_; }

    /// Returns the blocks of the next run; blocks that are left over are kNoBlock.
    std::vector<SampledBlock> next_run() {
        std::vector<SampledBlock> run(counts_.size(), SampledBlock{shared::kNoBlock, 0, vec2(0)});
        for (SampledBlock& entry : run) {
            while (!done() && taken_[block_] == counts_[block_]) ++block_;
            if (done()) break;
            const SampleView& sample = samples_[taken_[block_]++];
            entry = {static_cast<std::uint32_t>(block_), sample.sample, sample.jitter};
        }
        while (!done() && taken_[block_] == counts_[block_]) ++block_;
        return run;
    }

  private:
    std::vector<std::uint32_t> counts_;
    std::vector<SampleView> samples_;
    std::vector<std::uint32_t> taken_;
    std::size_t block_ = 0;
};

Accumulated imported(graph::Graph& graph, const SumBuffers& sums) {
    const auto import = [&](gpu::Buffer* b) { return b ? graph.import_buffer("sums", *b) : graph::BufferHandle{}; };
    Accumulated all;
    all.emission = import(sums.emission), all.direct = import(sums.direct), all.indirect = import(sums.indirect);
    all.squares = import(sums.squares), all.features = import(sums.features), all.halves = import(sums.halves);
    return all;
}

/// Returns the numbers of the blocks of a band in the picture's rows of blocks, in the order of the band's paths.
std::vector<std::size_t> blocks_in_picture(const Band& band) {
    std::vector<std::size_t> blocks;
    const uvec2 tiles = band.tiles();
    for (std::uint32_t path = 0; path < band.paths(); path += 256) {
        const uvec2 pixel = shared::pixel_of_path(path, tiles) + uvec2(0, static_cast<std::uint32_t>(band.y));
        blocks.push_back(std::size_t{pixel.y / 16} * tiles.x + pixel.x / 16);
    }
    return blocks;
}

}  // namespace

std::vector<std::uint32_t> Renderer::State::plan_samples(const FrameSettings& frame,
                                                         const std::function<bool()>& after_sample) {
    const ivec2 blocks = (ivec2(settings.width, settings.height) + 15) / 16;
    const auto all = static_cast<std::size_t>(blocks.x) * static_cast<std::size_t>(blocks.y);
    const int pilot = pilot_samples(frame.samples);
    FrameSettings pilots = frame;
    pilots.seed = shared::hash_combine(shared::hash_u32(frame.seed), 0x70696c6f);
    std::vector<float> errors(all);
    for (int b = 0; b < bands; ++b) {
        const Band where = band_at(b);
        CompiledBand& with = compiled(b);
        with.sample.adds_mattes = false;
        for (int done = 0; done < pilot; ++done) {
            add_sample(pilots, sample_view(pilots, where, static_cast<std::uint32_t>(done), settings.estimator.sampler),
                       with, with.sample);
            if (!after_sample()) break;
        }
        with.sample.adds_mattes = true;
        if (!after_sample()) return {};
        graph::Graph graph;
        const graph::BufferHandle read = add_block_errors(graph, band, imported(graph, with.sample.sums), pilot);
        graph.output(read);
        composer.run(graph::compile(graph));
        const std::vector<float> of_band = composer.read<float>(read);
        const std::vector<std::size_t> grid = blocks_in_picture(where);
        for (std::size_t i = 0; i < grid.size(); ++i)
            if (grid[i] < all) errors[grid[i]] = of_band[i];
    }
    return adaptive_counts(errors, blocks, static_cast<std::uint32_t>(least_samples(frame.samples)),
                           all * static_cast<std::uint64_t>(frame.samples));
}

int Renderer::State::render_band_adaptively(const FrameSettings& frame, const Band& where, CompiledBand& with,
                                            const std::vector<std::uint32_t>& plan, const AfterSample& after_sample) {
    const auto sample_of = [&](int number) {
        return sample_view(frame, where, static_cast<std::uint32_t>(number), settings.estimator.sampler);
    };
    const int least = least_samples(frame.samples);
    with.samples.clear();
    with.first_samples = least;
    for (int done = 0; done < least; ++done) {
        add_sample(frame, sample_of(done), with, with.sample);
        if (!after_sample(done + 1, frame.samples)) return with.first_samples = done + 1;
    }

    const std::vector<std::size_t> grid = blocks_in_picture(where);
    std::vector<std::uint32_t> further;
    for (const std::size_t place : grid)
        further.push_back(place < plan.size() ? plan[place] - static_cast<std::uint32_t>(least) : 0);
    std::vector<SampleView> samples;
    const auto most = static_cast<int>(std::ranges::max(further));
    for (int number = least; number < least + most; ++number) samples.push_back(sample_of(number));
    const auto all = std::accumulate(further.begin(), further.end(), std::uint64_t{0});
    ListedSamples listed(std::move(further), std::move(samples));
    bool go_on = true;
    for (std::uint64_t run = 1; go_on && !listed.done(); ++run) {
        const std::vector<SampledBlock> entries = listed.next_run();
        sampled_blocks->write(std::span<const SampledBlock>(entries));
        SampleView sample = sample_of(least);
        sample.begins = false;
        add_sample(frame, sample, with, *with.listed);
        const double share = std::min(double(run * grid.size()) / double(all), 1.0);
        go_on = after_sample(least + static_cast<int>(share * (frame.samples - least)), frame.samples);
    }

    for (const std::uint32_t taken : listed.taken()) with.samples.push_back(static_cast<std::uint32_t>(least) + taken);
    gpu::Buffer counts = gpu::Buffer::from("numbers of samples", with.samples);
    const int wanted = frame.samples / 2 * 2;  // both halves stand for as many
    graph::Graph graph;
    const gpu::Buffer* halves = with.sample.sums.halves;
    add_adaptive_mean(graph, band, imported(graph, with.sample.sums), graph.import_buffer("numbers of samples", counts),
                      static_cast<std::uint32_t>(wanted), halves ? halves->bytes() / sizeof(double) / band.paths() : 0);
    composer.run(graph::compile(graph));
    with.sample.sums.first_half = wanted / 2;
    return wanted;
}

}  // namespace halflight
