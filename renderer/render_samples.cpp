#include <algorithm>

#include "engine/core/error.h"
#include "engine/core/interruption.h"
#include "renderer/render_state.h"
#include "renderer/sample_pace.h"

namespace halflight {

shared::Frame Renderer::State::constants_of(const FrameSettings& frame, const SampleView& at) const {
    std::optional<FrameSettings> posed;
    if (posed_at) posed.emplace(frame).camera = posed_camera;
    shared::Frame constants = frame_constants(posed ? *posed : frame, scene.tables(), at);
    constants.transparent = settings.transparent ? 1 : 0;
    return constants;
}

void Renderer::State::pose(const FrameSettings& frame, std::optional<double> at) {
    if (!inputs.pose || posed_at == at) return;
    in_flight->wait();  // mattes are looked up in the tables of their pose
    posed_camera = inputs.pose(at);
    // A lens that focuses on a point of the picture keeps the distance at the time of the frame.
    if (options.lens && posed_camera.lens.focus.kind == Focus::Kind::point)
        posed_camera.lens.focus = frame.camera.lens.focus;
    posed_at = at;
}

void Renderer::State::upload_constants(const FrameSettings& frame, const SampleView& at) {
    const shared::Frame constants = constants_of(frame, at);
    frame_constants_buffer.write(0, sizeof(constants), &constants);
    current = at.band;
}

void Renderer::State::add_sample(const FrameSettings& frame, const Band& where, int done, CompiledBand& with,
                                 std::span<const int> order) {
    const int cached = cache ? kCachedSamples : 0;
    if (done < cached) {
        const std::uint32_t first = (cache->picture() - 1) * kCachedSamples;
        const auto index = static_cast<std::uint32_t>(done);
        add_sample(frame, cached_view(frame, where, first, index, settings.estimator.sampler), with,
                   SampleKind::cached);
    } else {
        if (cached > 0 && done == cached) {
            in_flight->wait();
            with.mattes->clear();
        }
        const int number = order.empty() ? frame.first_sample + done - cached : order[std::size_t(done)];
        SampleView sample = sample_view(frame, where, static_cast<std::uint32_t>(number), settings.estimator.sampler);
        sample.begins = done == cached;
        add_sample(frame, sample, with, SampleKind::plain);
    }
}

void Renderer::State::add_sample(const FrameSettings& frame, const SampleView& at, CompiledBand& with,
                                 SampleKind kind) {
    const BandGraphs& graphs = with.graphs;
    const SampleGraph& sample = kind == SampleKind::cached   ? *graphs.cached
                                : kind == SampleKind::listed ? *graphs.listed
                                                             : graphs.sample;
    SumBuffers& sums = kind == SampleKind::cached ? with.cached_sums : with.sums;
    const int first_half = (at.begins ? 0 : sums.first_half) + (at.first_half ? 1 : 0);
    pose(frame, at.at);
    upload_constants(frame, at);
    const int seen = static_cast<int>(seen_constants.size());
    for (int i = 0; i < seen; ++i) {
        const shared::Frame constants = constants_of(frame, seen_view(at, frame.filter, i, seen));
        seen_constants[std::size_t(i)].write(0, sizeof(constants), &constants);
    }
    executor.run(sample.compiled);
    if (kind != SampleKind::listed) sums = sums_of(sample, first_half);
    const bool matte = (kind == SampleKind::plain || kind == SampleKind::cached) && !with.mattes->empty();
    in_flight->push(matte ? &executor.buffer(sample.frame.gbuffer.hits) : nullptr, with.mattes.get());
    // The sample's time decides about the next sample, or about the next picture that a viewer asks for.
    if (frame.time_limit > 0 || settings.in_turns) in_flight->wait();
    scene.context().check("rendering");
}

int Renderer::State::render_band(const FrameSettings& frame, const Band& where, CompiledBand& with, int first,
                                 double time_limit, const AfterSample& after_sample) {
    const Stopwatch watch;
    const double compiled_before = scene.programs().compile_seconds();
    const int least = settings.denoise ? 2 : 1;  // samples that the filter needs
    SamplePace pace;
    int saved = first;  // number of samples of the last save
    // Samples that a limit of time may leave out are taken in their own order.
    std::vector<int> order;
    if (!(time_limit > 0))
        order = order_of_samples(frame, frame.first_sample, frame.first_sample + frame.samples, [&](int number) {
            return sample_view(frame, where, static_cast<std::uint32_t>(number), settings.estimator.sampler);
        });
    for (int done = first + 1;; ++done) {
        const std::uint64_t interrupted = interruptions();
        try {
            add_sample(frame, where, done - 1, with, order);
        } catch (...) {
            // The sums are those of the last sample: points of interruption precede the pass that adds to them.
            if (inputs.checkpoint && interruptions() != interrupted && done - 1 > saved)
                save(*inputs.checkpoint, where, with, done - 1, false);
            throw;
        }
        const bool go_on = after_sample(done, frame.samples);
        pace.add(watch.seconds(), scene.programs().compile_seconds() - compiled_before);
        const bool time_is_up = time_limit > 0 && done >= least && !pace.another_fits(time_limit);
        const bool complete = done == frame.samples || (go_on && time_is_up);
        if (inputs.checkpoint && (!go_on || complete || inputs.checkpoint->due()))
            save(*inputs.checkpoint, where, with, saved = done, complete);
        if (!go_on || complete) return done;
    }
}

namespace {

/// Place of a band among the looks at its error.
struct Looks {
    int each = 0;           // samples of a replicate at the last look
    int next = kFirstLook;  // samples of a replicate at the next look
    int replicate = 0;      // replicate that grows
    int taken = 0;          // samples that it has got since the last look
    int chances = 0;        // PictureError::judge()

    explicit Looks(const std::vector<std::uint64_t>& numbers) {
        const auto number = [&](std::size_t i) { return static_cast<int>(numbers[i]); };
        if (numbers.size() == 6)
            each = number(0), next = number(1), replicate = number(2), taken = number(3), chances = number(4);
    }
    std::vector<std::uint64_t> numbers(bool ends) const {
        const auto number = [](int n) { return static_cast<std::uint64_t>(n); };
        return {number(each), number(next), number(replicate), number(taken), number(chances), ends ? 1u : 0u};
    }
    int done() const { return each * kReplicates + replicate * (next - each) + taken; }
};

}  // namespace

int Renderer::State::render_band_to_error(const FrameSettings& frame, const Band& where, CompiledBand& with,
                                          double time_limit, const AfterSample& after_sample,
                                          PictureError& picture_error, const PlanState& state) {
    const Stopwatch watch;
    const double compiled_before = scene.programs().compile_seconds();
    SamplePace pace;
    const int most = std::min(frame.samples / kReplicates, kMostReplicateSamples);
    BandReplicates replicates(where);
    Looks looks(state.numbers);
    if (!state.numbers.empty() && !replicates.set(state.arrays))
        throw Error(inputs.checkpoint->folder().string(), "its replicates do not fit the picture");
    bool ends = !state.numbers.empty() && state.numbers.back() > 0;
    const auto save_band = [&] {
        if (inputs.checkpoint && looks.done() > 0)
            save(*inputs.checkpoint, where, with, looks.done(), ends, {looks.numbers(ends), replicates.state()});
    };
    PictureError error;
    if (ends) {  // an earlier run has reached this look
        error = replicates.error(frame.error->metric, looks.each);
        error.judge(frame.error->error, looks.chances);
        picture_error.add(error);
        return looks.done();
    }
    while (!ends) {
        for (; looks.replicate < kReplicates; ++looks.replicate, looks.taken = 0) {
            const auto view = [&](int i) {
                return replicate_view(frame, where, looks.replicate, i, settings.estimator.sampler);
            };
            const std::vector<int> order = order_of_samples(frame, looks.each, looks.next, view);
            while (looks.taken < looks.next - looks.each) {
                SampleView sample = view(order.empty() ? looks.each + looks.taken : order[std::size_t(looks.taken)]);
                sample.begins = looks.done() == 0;
                const std::uint64_t interrupted = interruptions();
                try {
                    add_sample(frame, sample, with, SampleKind::plain);
                } catch (...) {
                    if (interruptions() != interrupted) save_band();
                    throw;
                }
                ++looks.taken;
                const bool go_on = after_sample(looks.done(), looks.next * kReplicates);
                if (!go_on || (inputs.checkpoint && inputs.checkpoint->due())) save_band();
                if (!go_on) return looks.done();
                pace.add(watch.seconds(), scene.programs().compile_seconds() - compiled_before);
            }
            replicates.add(looks.replicate, light(with.sums));
        }
        looks.each = looks.next, looks.replicate = 0;
        error = replicates.error(frame.error->metric, looks.each);
        int chances = looks.chances;
        const ErrorEstimate estimate = error.judge(frame.error->error, chances);
        int next = std::min(next_replicate_samples(looks.each, estimate, frame.error->error), most);
        if (time_limit > 0) {
            const double left = (time_limit - pace.overhead()) / std::max(watch.seconds() - pace.overhead(), 1e-9);
            next = static_cast<int>(std::min<double>(next, looks.each * left));
        }
        ends = estimate.bound <= frame.error->error || next <= looks.each;
        if (!ends) looks.next = next, looks.chances = chances;
    }
    save_band();
    picture_error.add(error);
    return looks.done();
}

void Renderer::State::render_in_turns(const FrameSettings& frame, double time_limit, std::vector<int>& done,
                                      const std::function<bool()>& after_sample) {
    const Stopwatch watch;
    const double compiled_before = scene.programs().compile_seconds();
    const int least = settings.denoise ? 2 : 1;  // samples that the filter needs
    SamplePace pace;
    for (int b = 0; b < bands; ++b) compiled(b).mattes->clear();
    for (int i = 0; i < frame.samples; ++i) {
        for (int b = 0; b < bands; ++b) {
            add_sample(frame, band_at(b), i, compiled(b));
            done[std::size_t(b)] = i + 1;
            if (!after_sample()) return;
        }
        pace.add(watch.seconds(), scene.programs().compile_seconds() - compiled_before);
        if (time_limit > 0 && i + 1 >= least && !pace.another_fits(time_limit)) return;
    }
}

SumBuffers Renderer::State::sums_of(const SampleGraph& sample, int first_half) {
    const Accumulated& a = sample.frame.sums;
    const auto buffer = [&](graph::BufferHandle h) { return h ? &executor.buffer(h) : nullptr; };
    return {buffer(a.emission), buffer(a.direct), buffer(a.indirect), buffer(a.squares), buffer(a.features),
            buffer(a.halves),   buffer(a.groups), buffer(a.catchers), first_half};
}

std::vector<double> Renderer::State::read(const gpu::Buffer* b) {
    return b ? b->read<double>() : std::vector<double>{};
}

Film::Sums Renderer::State::light(const SumBuffers& sums) {
    return {read(sums.emission), read(sums.direct), read(sums.indirect), {}, {}, {}};
}

}  // namespace halflight
