// Adaptive sampling (passes/picture/adaptive.h): a pilot decides the shares of the blocks and is thrown away. With an
// error target, all replicates of a block then take the same number of samples, so they are independent and distributed
// alike, as ReplicateError demands. All bands grow together until the picture meets the error or its time is up, so
// that it does not depend on them.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "passes/picture/adaptive.h"
#include "renderer/sampling.h"
#include "shaders/shared/sobol.h"

namespace halflight {
namespace {

using shared::SampledBlock;

ivec2 blocks_of(const RenderSettings& settings) {
    return (ivec2(settings.width, settings.height) + 15) / 16;
}

/// Counts the samples of a sequence that are in the first half.
class FirstHalves {
  public:
    explicit FirstHalves(ListedSamples::SampleOf sample_of) : sample_of_(std::move(sample_of)) {}
    /// Returns how many of the first `count` samples are in the first half.
    std::uint32_t among(std::uint32_t count) {
        while (sums_.size() <= count) {
            const auto number = static_cast<std::uint32_t>(sums_.size() - 1);
            sums_.push_back(sums_.back() + (sample_of_(number).first_half ? 1 : 0));
        }
        return sums_[count];
    }

  private:
    ListedSamples::SampleOf sample_of_;
    std::vector<std::uint32_t> sums_{0};
};

}  // namespace

double Renderer::State::Sampling::mean_of(const Counts& counts) {
    return static_cast<double>(std::accumulate(counts.begin(), counts.end(), std::uint64_t{0})) /
           static_cast<double>(counts.size());
}

bool Renderer::State::Sampling::find_noise() {
    const ivec2 blocks = blocks_of(s_.settings);
    if (!plan_.grows) {
        const std::vector<float> errors = pilot_errors(0, pilot_samples(own_.samples), ErrorMetric::relmse);
        if (errors.empty()) return false;
        noise_[part_].wanted = adaptive_counts(errors, blocks, static_cast<std::uint32_t>(plan_.least),
                                               errors.size() * static_cast<std::uint64_t>(own_.samples));
        return true;
    }
    const ErrorMetric metric = own_.error ? own_.error->metric : ErrorMetric::relmse;
    const int first = pilot_samples(0);
    std::vector<float> errors = pilot_errors(0, first, metric);
    if (errors.empty()) return false;
    std::vector<double> deviations = block_deviations(errors, blocks);
    // Sequences converge faster than independent samples, of which fewer than half are needed in most pictures.
    const int pilot =
        own_.error ? pilot_samples(std::min(own_.samples, expected_samples(deviations, own_.error->error) / 2)) : first;
    if (pilot != first) {
        errors = pilot_errors(first, pilot, metric);
        if (errors.empty()) return false;
        deviations = block_deviations(errors, blocks);
    }
    noise_[part_].deviations = std::move(deviations);
    return true;
}

std::vector<float> Renderer::State::Sampling::pilot_errors(int from, int to, ErrorMetric metric) {
    const ivec2 blocks = blocks_of(s_.settings);
    std::vector<float> errors(static_cast<std::size_t>(blocks.x) * static_cast<std::size_t>(blocks.y));
    FrameSettings pilots = own_;
    pilots.seed = shared::hash_combine(shared::hash_u32(own_.seed), 0x70696c6f);
    pilots.first_sample = 0;
    for (int b = 0; b < s_.bands.count; ++b) {
        const Band where = s_.bands.at(b);
        CompiledBand& with = s_.compiled(b);
        for (int done = from; done < to; ++done) {
            const SampleView pilot =
                sample_view(pilots, where, static_cast<std::uint32_t>(done), s_.settings.estimator.sampler);
            s_.add_sample(pilots, pilot, with, SampleKind::pilot);
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

auto Renderer::State::Sampling::counts_at(int each) const -> Counts {
    const Noise& noise = noise_.at(part_);
    if (!plan_.grows) return noise.wanted;
    const std::uint32_t most = own_.error ? kMostReplicateSamples : kMaxSamples;
    return replicate_counts(noise.deviations, static_cast<std::uint32_t>(each), static_cast<std::uint32_t>(plan_.least),
                            most);
}

auto Renderer::State::Sampling::counts_of(const BandSamples& band, int each) const -> Counts {
    Counts counts(band.grid.size(), static_cast<std::uint32_t>(plan_.least));
    if (each == 0) return counts;
    const Counts picture = counts_at(each);
    for (std::size_t b = 0; b < counts.size(); ++b)
        if (band.grid[b] < picture.size()) counts[b] = picture[band.grid[b]];
    return counts;
}

ListedSamples Renderer::State::Sampling::listed(const BandSamples& band) const {
    const Look& look = band.look;
    ListedSamples listed(counts_of(band, look.each), counts_of(band, look.next),
                         [this, &band](std::uint32_t index) { return view(band, static_cast<int>(index)); });
    for (std::uint64_t run = 0; run < look.runs && !listed.done(); ++run) listed.next_run();
    return listed;
}

bool Renderer::State::Sampling::add_listed(BandSamples& band) {
    Look& look = band.look;
    ListedSamples samples = listed(band);
    const auto all = static_cast<double>(samples.left());
    SampleView run = view(band, plan_.least);  // any of them
    run.begins = false;
    const int before = plan_.done(look.each, look.next, look.sequence, look.taken);
    bool go = true;
    while (go && !samples.done()) {
        run.at = samples.at(), run.seed = samples.seed();
        const std::vector<SampledBlock> entries = samples.next_run();
        s_.sample.blocks->write(std::span<const SampledBlock>(entries));
        add(own_, band, run, SampleKind::listed);
        ++look.runs;
        const double share = 1 - static_cast<double>(samples.left()) / all;
        go = go_on(band, before + static_cast<int>(share * (look.next - look.each - look.taken)));
    }
    return go;
}

BlockSamples Renderer::State::Sampling::taken(const BandSamples& band) const {
    const Look& look = band.look;
    BlockSamples sum;
    BandSamples at{.index = band.index, .where = band.where};
    for (at.look.sequence = 0; at.look.sequence < plan_.sequences; ++at.look.sequence) {
        const bool grows = at.look.sequence == look.sequence && look.taken + look.runs > 0;
        const int each = at.look.sequence < look.sequence ? look.next : look.each;
        BlockSamples part{Counts(band.grid.size()), Counts(band.grid.size())};
        Counts first(band.grid.size());  // numbers of samples that follow each other in the sequence
        if (each > 0) first = counts_of(band, each);
        if (grows && look.each == 0) first.assign(first.size(), static_cast<std::uint32_t>(look.taken));
        part.all = first;
        if (grows && look.runs > 0) {
            const ListedSamples more = listed(band);
            part.all = more.taken(), part.first_half = more.first_halves();
        }
        FirstHalves halves([&](std::uint32_t index) { return view(at, static_cast<int>(index)); });
        for (std::size_t b = 0; b < first.size(); ++b) part.first_half[b] += halves.among(first[b]);
        sum.add(part);
    }
    return sum;
}

void Renderer::State::Sampling::scale(BandSamples& band) {
    CompiledBand& with = *band.with;
    const Look& look = band.look;
    const bool all_equal = parts_ == 1 && look.each <= plan_.least &&
                           (look.next <= plan_.least || (look.each == 0 && look.taken < plan_.least));
    if (all_equal || done_[std::size_t(band.index)] == 0) return;
    const BlockSamples blocks = parts_ > 1 ? band.earlier.blocks : taken(band);
    with.samples = blocks.all;
    with.first_samples = parts_ > 1 ? band.earlier.mattes : plan_.least * plan_.sequences;
    int wanted = frame_.samples / 2 * 2;  // both halves stand for as many
    if (plan_.grows) {
        double mean = mean_of(blocks.all);
        if (!stopped_) mean = parts_ > 1 ? band.earlier.mean : plan_.sequences * mean_of(counts_at(look.each));
        wanted = 2 * static_cast<int>(std::lround(mean / 2));
    }
    done_[std::size_t(band.index)] = wanted;
    gpu::Buffer counts = gpu::Buffer::from("numbers of samples", blocks.all);
    gpu::Buffer first = gpu::Buffer::from("samples of the first half", blocks.first_half);
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

void Renderer::State::Sampling::add_error(const BandSamples& band, int each, PictureError& error) const {
    Counts counts;
    if (each > 0) {
        counts = plan_.least > 0 ? counts_of(band, each) : Counts(1, static_cast<std::uint32_t>(each));
    } else {
        counts =
            plan_.least > 0 ? band.earlier.blocks.all : Counts(1, static_cast<std::uint32_t>(band.earlier.samples));
        for (std::uint32_t& count : counts) count /= static_cast<std::uint32_t>(plan_.sequences);
    }
    const BandReplicates& replicates = each > 0 ? *band.replicates : *band.earlier.replicates;
    replicates.add_error(own_.error->metric, counts, error);
}

}  // namespace halflight
