#include <algorithm>

#include "engine/core/interruption.h"
#include "renderer/render_state.h"
#include "renderer/sample_pace.h"

namespace halflight {

shared::Frame Renderer::State::constants_of(const FrameSettings& frame, const SampleView& at) const {
    std::optional<FrameSettings> posed;
    if (frame.shutter && posed_at) posed.emplace(frame).camera = posed_camera;
    shared::Frame constants = frame_constants(posed ? *posed : frame, scene.tables(), at);
    constants.transparent = settings.transparent ? 1 : 0;
    return constants;
}

void Renderer::State::pose(const FrameSettings& frame, std::optional<double> at) {
    if (!frame.shutter || posed_at == at) return;
    in_flight->wait();  // mattes are looked up in the tables of their pose
    posed_camera = frame.shutter->pose(at);
    // A lens that focuses on a point of the picture keeps the distance at the time of the frame.
    if (lens && posed_camera.lens.focus.kind == Focus::Kind::point) posed_camera.lens.focus = frame.camera.lens.focus;
    posed_at = at;
}

void Renderer::State::upload_constants(const FrameSettings& frame, const SampleView& at) {
    const shared::Frame constants = constants_of(frame, at);
    frame_constants_buffer.write(0, sizeof(constants), &constants);
    current = at.band;
}

void Renderer::State::add_sample(const FrameSettings& frame, const Band& where, int done, CompiledBand& with,
                                 std::span<const int> order) {
    const int cached = with.cached ? kCachedSamples : 0;
    if (done < cached) {
        const std::uint32_t first = (cache->picture() - 1) * kCachedSamples;
        const auto index = static_cast<std::uint32_t>(done);
        add_sample(frame, cached_view(frame, where, first, index, settings.estimator.sampler), with, *with.cached);
    } else {
        if (cached > 0 && done == cached) {
            in_flight->wait();
            with.mattes->clear();
        }
        const int number = order.empty() ? frame.first_sample + done - cached : order[std::size_t(done)];
        SampleView sample = sample_view(frame, where, static_cast<std::uint32_t>(number), settings.estimator.sampler);
        sample.begins = done == cached;
        add_sample(frame, sample, with, with.sample);
    }
}

void Renderer::State::add_sample(const FrameSettings& frame, const SampleView& at, CompiledBand& with,
                                 CompiledSample& sample) {
    const int first_half = (at.begins ? 0 : sample.sums.first_half) + (at.first_half ? 1 : 0);
    if (frame.shutter) pose(frame, at.at);
    upload_constants(frame, at);
    const int seen = static_cast<int>(seen_constants.size());
    for (int i = 0; i < seen; ++i) {
        const shared::Frame constants = constants_of(frame, seen_view(at, frame.filter, i, seen));
        seen_constants[std::size_t(i)].write(0, sizeof(constants), &constants);
    }
    executor.run(sample.compiled);
    sample.sums = sums_of(sample, first_half);
    const bool matte = sample.adds_mattes && !with.mattes->empty();
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
            if (frame.checkpoint && interruptions() != interrupted && done - 1 > saved)
                save(*frame.checkpoint, where, with, done - 1, false);
            throw;
        }
        const bool go_on = after_sample(done, frame.samples);
        pace.add(watch.seconds(), scene.programs().compile_seconds() - compiled_before);
        const bool time_is_up = time_limit > 0 && done >= least && !pace.another_fits(time_limit);
        const bool complete = done == frame.samples || (go_on && time_is_up);
        if (frame.checkpoint && (!go_on || complete || frame.checkpoint->due()))
            save(*frame.checkpoint, where, with, saved = done, complete);
        if (!go_on || complete) return done;
    }
}

int Renderer::State::render_band_to_error(const FrameSettings& frame, const Band& where, CompiledBand& with,
                                          double time_limit, const AfterSample& after_sample,
                                          PictureError& picture_error) {
    const Stopwatch watch;
    const double compiled_before = scene.programs().compile_seconds();
    SamplePace pace;
    const int most = std::min(frame.samples / kReplicates, kMostReplicateSamples);
    BandReplicates replicates(where);
    int done = 0;
    int each = 0;  // number of samples of a replicate
    PictureError error;
    for (int next = kFirstLook, chances = 0; next > each;) {
        for (int r = 0; r < kReplicates; ++r) {
            const auto view = [&](int i) { return replicate_view(frame, where, r, i, settings.estimator.sampler); };
            const std::vector<int> order = order_of_samples(frame, each, next, view);
            for (int i = each; i < next; ++i) {
                SampleView sample = view(order.empty() ? i : order[std::size_t(i - each)]);
                sample.begins = done == 0;
                add_sample(frame, sample, with, with.sample);
                if (!after_sample(++done, next * kReplicates)) return done;
                pace.add(watch.seconds(), scene.programs().compile_seconds() - compiled_before);
            }
            replicates.add(r, light(with.sample.sums));
        }
        each = next;
        error = replicates.error(frame.error->metric, each);
        const ErrorEstimate estimate = error.judge(frame.error->error, chances);
        if (estimate.bound <= frame.error->error) break;
        next = std::min(next_replicate_samples(each, estimate, frame.error->error), most);
        if (time_limit > 0) {
            const double left = (time_limit - pace.overhead()) / std::max(watch.seconds() - pace.overhead(), 1e-9);
            next = static_cast<int>(std::min<double>(next, each * left));
        }
    }
    picture_error.add(error);
    return done;
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

SumBuffers Renderer::State::sums_of(const CompiledSample& sample, int first_half) {
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
