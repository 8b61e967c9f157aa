#include "renderer/render_state.h"

namespace halflight {

shared::Frame Renderer::State::constants_of(const FrameSettings& frame, const SampleView& at) const {
    std::optional<FrameSettings> posed;
    if (inputs.pose && pose.at) posed.emplace(frame).camera = pose.camera;
    shared::Frame constants = frame_constants(posed ? *posed : frame, scene.tables(), at);
    constants.transparent = settings.transparent ? 1 : 0;
    return constants;
}

void Renderer::State::set_pose(const FrameSettings& frame, std::optional<double> at) {
    if (!inputs.pose || pose.at == at) return;
    in_flight->wait();  // mattes are looked up in the tables of their pose
    pose.camera = inputs.pose(at);
    // A lens that focuses on a point of the picture keeps the distance at the time of the frame.
    if (options.lens && pose.camera.lens.focus.kind == Focus::Kind::point)
        pose.camera.lens.focus = frame.camera.lens.focus;
    pose.at = at;
}

void Renderer::State::upload_constants(const FrameSettings& frame, const SampleView& at) {
    const shared::Frame constants = constants_of(frame, at);
    sample.frame.write(0, sizeof(constants), &constants);
    sample.band = at.band;
}

void Renderer::State::add_sample(const FrameSettings& frame, const SampleView& at, CompiledBand& with,
                                 SampleKind kind) {
    const BandGraphs& graphs = with.graphs;
    const SampleGraph& graph = kind == SampleKind::cached   ? *graphs.cached
                               : kind == SampleKind::listed ? *graphs.listed
                                                            : graphs.sample;
    SumBuffers& sums = kind == SampleKind::cached ? with.cached_sums : with.sums;
    const int first_half = (at.begins ? 0 : sums.first_half) + (at.first_half ? 1 : 0);
    set_pose(frame, at.at);
    upload_constants(frame, at);
    const int seen = static_cast<int>(sample.seen.size());
    for (int i = 0; i < seen; ++i) {
        const shared::Frame constants = constants_of(frame, seen_view(at, frame.filter, i, seen));
        sample.seen[std::size_t(i)].write(0, sizeof(constants), &constants);
    }
    executor.run(graph.compiled);
    if (kind != SampleKind::listed) sums = sums_of(graph, first_half);
    const bool matte = (kind == SampleKind::plain || kind == SampleKind::cached) && !with.mattes->empty();
    in_flight->push(matte ? &executor.buffer(graph.frame.gbuffer.hits) : nullptr, with.mattes.get());
    // The sample's time decides about the next sample, or about the next picture that a viewer asks for.
    if (frame.time_limit > 0 || settings.in_turns) in_flight->wait();
    scene.context().check("rendering");
}

SumBuffers Renderer::State::sums_of(const SampleGraph& graph, int first_half) {
    const Accumulated& a = graph.frame.sums;
    const auto buffer = [&](graph::BufferHandle h) { return h ? &executor.buffer(h) : nullptr; };
    return {buffer(a.emission), buffer(a.direct), buffer(a.indirect), buffer(a.squares), buffer(a.features),
            buffer(a.halves),   buffer(a.groups), buffer(a.catchers), first_half};
}

std::vector<double> Renderer::State::read(const gpu::Buffer* b) {
    return b ? b->read<double>() : std::vector<double>{};
}

Film::Sums Renderer::State::light(const SumBuffers& sums) {
    return {read(sums.emission), read(sums.direct), read(sums.indirect), {}, {}, {}, {}};
}

}  // namespace halflight
