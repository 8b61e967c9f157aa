#include "renderer/band_graphs.h"

#include <algorithm>
#include <map>
#include <string>

#include "engine/rays/tracer.h"
#include "passes/light/specular_chain.h"
#include "passes/picture/aov.h"
#include "renderer/film.h"
#include "renderer/frame_options.h"

namespace halflight {
namespace {

SceneView view_of(const GraphInputs& in, const Band& band, const BandPlace& place, graph::Graph& graph) {
    return {.scene = in.scene,
            .trace = in.trace,
            .tracer = *in.tracer,
            .band = band,
            .frame_constants = graph.import_buffer("frame constants", in.frame_constants),
            .place = place.state,
            .current = in.current,
            .rows = in.rows,
            .shadow_rays = static_cast<std::uint32_t>(in.options.shadow_rays),
            .optics = in.options.optics,
            .backfaces = in.settings.backfaces};
}

/// Compiles the graph of a sample. listed: it samples the blocks of sampled_blocks.
void compile(SampleGraph& sample, const GraphInputs& in, SceneView view, const FrameOptions& options,
             std::uint32_t sums, bool listed = false) {
    if (listed) view.sampled_blocks = sample.graph.import_buffer("sampled blocks", *in.sampled_blocks);
    view.light_groups = static_cast<std::uint32_t>(options.light_groups);
    view.lens = options.lens;  // layers at the pixels' centres are those of a pinhole
    std::vector<graph::BufferHandle> constants;
    for (gpu::Buffer& seen : in.seen_constants)
        constants.push_back(sample.graph.import_buffer("constants of light seen", seen));
    sample.frame = add_frame(sample.graph, view, options, {*in.bad_values, constants, in.cache, sums});
    sample.compiled = graph::compile(sample.graph);
}

bool is_carried(const graph::PlannedResource& r) {
    return r.used && r.node.kind != graph::ResourceKind::transient && r.node.kind != graph::ResourceKind::imported;
}

}  // namespace

BandGraphs::BandGraphs(const GraphInputs& in, const Band& band, const BandPlace& place) {
    const RenderSettings& s = in.settings;
    compile(sample, in, view_of(in, band, place, sample.graph), in.options, place.sums);
    if (in.options.adaptive) {
        listed = std::make_unique<SampleGraph>();
        compile(*listed, in, view_of(in, band, place, listed->graph), listed_options(in.options), place.sums, true);
    }
    if (in.cache) {
        cached = std::make_unique<SampleGraph>();
        compile(*cached, in, view_of(in, band, place, cached->graph), cached_options(in.options), place.cached_sums);
    }

    const DebugOptions wanted{asked_for(s, "nodes"), asked_for(s, "culling"), asked_for(s, "residency")};
    const bool keep = s.kept.is_everything();
    if (wanted.any()) {
        const SceneView seen = view_of(in, band, place, debug_graph);
        const GBuffer gbuffer =
            add_gbuffer(debug_graph, seen, {.rays = true, .hits = wanted.residency || keep}, s.primary);
        debug_graph.output(debug = add_debug_aov(debug_graph, seen, gbuffer, wanted));
        debug_data = graph::compile(debug_graph);
    }
    if (!asked_for(s, {LayerSource::record}) && !s.preview.temporal && neighbour_frames(s) == 0) return;
    const SceneView seen = view_of(in, band, place, data_graph);
    const GBuffer gbuffer = add_gbuffer(data_graph, seen, {.rays = keep, .hits = true}, s.primary);
    data_graph.output(aov = add_aov(data_graph, seen, gbuffer, asked_for(s, "motion") || keep));
    if (frame_needs(in.scene.needs(), in.options).chains && neighbour_frames(s) > 0) {
        chains = add_specular_chains(data_graph, seen, gbuffer, {.bounces = bounces_of(s), .places = true}).places;
        data_graph.output(chains);
    }
    data = graph::compile(data_graph);
}

std::vector<const graph::CompiledGraph*> BandGraphs::all() const {
    std::vector<const graph::CompiledGraph*> all{&sample.compiled, &data, &debug_data};
    if (listed) all.push_back(&listed->compiled);
    if (cached) all.push_back(&cached->compiled);
    return all;
}

std::size_t BandGraphs::transient_bytes() const {
    std::size_t most = 0;
    for (const graph::CompiledGraph* g : all()) most = std::max(most, g->slot_bytes);
    return most;
}

std::size_t BandGraphs::carried_bytes() const {
    std::map<std::string, std::size_t> bytes;  // graphs share what has the same name
    for (const graph::CompiledGraph* g : all())
        for (const graph::PlannedResource& r : g->resources)
            if (is_carried(r)) bytes[r.node.name] = r.node.buffer.bytes;
    std::size_t sum = 0;
    for (const auto& [name, of_name] : bytes) sum += of_name;
    return sum;
}

std::size_t most_paths(GraphInputs inputs, rays::Culling culling, const gpu::Limits& limits) {
    const Band block{.image = ivec2(16), .rows = 16};  // bytes are multiples of the number of paths
    rays::Tracer tracer(inputs.trace, culling);
    gpu::Buffer none("", 0, gpu::Buffer::Unmade{});
    inputs.tracer = &tracer, inputs.bad_values = inputs.sampled_blocks = &none;
    const BandGraphs graphs(inputs, block);
    std::size_t widest = 1;
    for (const graph::CompiledGraph* g : graphs.all())
        for (const graph::PlannedResource& r : g->resources)
            if (r.used && !r.node.is_texture && r.node.kind != graph::ResourceKind::imported)
                widest = std::max(widest, r.node.buffer.bytes);
    const FrameNeeds needs = frame_needs(inputs.scene.needs(), inputs.options);
    const int rays =
        std::max(needs.reuse ? inputs.options.group_size : 1, needs.shadow ? inputs.options.shadow_rays : 1);
    return std::min(limits.storage_block_bytes / widest * block.paths(),
                    static_cast<std::size_t>(limits.workgroup_count) * 64 / static_cast<std::size_t>(rays));
}

}  // namespace halflight
