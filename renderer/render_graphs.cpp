#include <fmt/ranges.h>

#include <algorithm>
#include <cstdint>

#include "engine/core/error.h"
#include "engine/rays/batch_server.h"
#include "passes/steps/paths.h"
#include "passes/light/specular_chain.h"
#include "passes/picture/aov.h"
#include "renderer/band_size.h"
#include "renderer/frame_options.h"
#include "renderer/render_state.h"
#include "shaders/shared/path_state.h"
#include "shaders/shared/sampled_block.h"

namespace halflight {
namespace {

/// Throws Error unless the settings request the layers of all light groups of a scene, in their order, or none.
void check_light_groups(const RenderSettings& settings, const std::vector<std::string>& groups) {
    std::vector<std::string> layers;
    for (const std::string& group : groups) layers.push_back(std::string(kLightGroupLayer) + group);
    const std::vector<std::string> asked = light_group_layers(settings);
    if (!asked.empty() && asked != layers)
        throw Error("render settings", "layers of light groups {} are not those of the scene: {}",
                    fmt::join(asked, ", "), layers.empty() ? "none" : fmt::format("{}", fmt::join(layers, ", ")));
}

}  // namespace

Renderer::State::State(std::unique_ptr<PreparedScene> o, PreparedScene& s, const ColorConfig& c,
                       std::optional<ViewKernel> view, RenderSettings r, rays::BatchServer* callers_server,
                       std::shared_ptr<RadianceCache> callers_cache)
    : own(std::move(o)),
      scene(s),
      colors(c),
      asked(std::move(r)),
      settings(asked),
      lens(settings.camera.lens.blurs()),
      optics(settings.camera.optics.traced()),
      given_server(callers_server),
      given_cache(std::move(callers_cache)),
      server(callers_server),
      view_kernel(std::move(view)),
      executor(scene.programs()),
      composer(scene.programs()) {
    if (leaves_open(scene.estimator()))
        throw Error("render settings", "the estimator is left open: a pilot has to settle it first");
    scene.check_usable();
    if (paging::PagePool* const pool = scene.pool()) {
        if (server)
            throw Error("render settings", "ray servers of callers cannot trace scenes that are loaded in pages");
        using Method = paging::PageQueries::Method;
        page_server = std::make_unique<paging::PageServer>(
            *pool, settings.page_schedule,
            settings.culling == rays::Culling::raster ? Method::raster : Method::compute);
        page_rows = std::make_unique<paging::RowGather>(pool->source());
        server = page_server.get();
        settings.culling = rays::Culling::off;
        if (settings.primary == PrimaryVisibility::raster)
            throw Error("render settings", "primary raster needs the scene in memory; pages are traced");
        settings.primary = PrimaryVisibility::traced;
    } else if (const auto make = row_of(settings.culling).make_server; make && !server) {
        own_server = make(served());
        server = own_server.get();
    }
    if (server)
        tracer.emplace(scene.trace(), *server);
    else
        tracer.emplace(scene.trace(), settings.culling);
    if (settings.culling == rays::Culling::automatic && !server) {
        offered_server = rays::offered_native_server(served());
        if (offered_server) tracer->offer(*offered_server);
    }
    check_light_groups(settings, scene.light_groups());
    settings.kept = scene.kept();
    settings.estimator = scene.estimator();
    settings.primary = resolved(settings.primary, scene.drawn_triangles(), ivec2(settings.width, settings.height),
                                shown_by_tracing(settings.camera.optics, lens, has_overscan(asked)));
    if (needs().seen)
        for (int i = 0; i < static_cast<int>(settings.estimator.camera); ++i)
            seen_constants.emplace_back("constants of light seen", sizeof(shared::Frame));
    if (settings.preview.cache && frame_needs(scene.buffers().needs(), cached_options()).radiance_cache)
        cache = given_cache ? given_cache : std::make_shared<RadianceCache>();
    const gpu::Limits& limits = scene.context().limits();
    std::size_t most = SIZE_MAX;
    if (needs().reuse)
        most = most_paths_of_batch(*tracer, rays::RayKind::connection,
                                   static_cast<std::uint32_t>(settings.estimator.reuse),
                                   scene.buffers().needs().reuse_point_bytes(), limits);
    const auto shadow_rays = static_cast<std::uint32_t>(settings.estimator.shadow);
    if (needs().shadow && shadow_rays > 1) {
        const std::size_t light = (shadow_rays + 1) * sizeof(shared::DirectLight);  // rays to lights and one to the sun
        most = std::min(most, most_paths_of_batch(*tracer, rays::RayKind::shadow, shadow_rays, light, limits));
    }
    if (needs().light_groups) most = std::min(most, limits.storage_block_bytes / needs().light_groups.path_bytes);
    if (needs().halves) most = std::min(most, limits.storage_block_bytes / needs().halves.path_bytes);
    band = first_band(asked, scene.buffers(), most, limits);
    if (const auto groups = static_cast<std::size_t>(light_group_layers(settings).size()); groups > 0) {
        const bool reuse = bool(needs().reuse);
        const std::size_t widest = std::max({groups * 3 * sizeof(double), group_light_bytes(groups, reuse),
                                             reuse ? groups * sizeof(shared::DirectLight) : 0});
        if (band.paths() > limits.storage_block_bytes / widest)
            throw Error(
                "render settings",
                "{} pixels wide with {} light groups: the driver's storage blocks hold {} bytes (--crop renders "
                "parts)",
                band.image.x, groups, limits.storage_block_bytes);
    }
    // From here on, the rendered pixels are the picture; finish() cuts out those that were asked for.
    settings.width = band.image.x, settings.height = band.image.y;
    settings.crop.reset(), settings.overscan = 0;
    bands = (settings.height + band.rows - 1) / band.rows;
    in_flight.emplace(band.paths());
    if (settings.adaptive) {
        settings.in_turns = false;
        sampled_blocks.emplace("sampled blocks", band.paths() / 256 * sizeof(shared::SampledBlock));
    }
    const FrameOptions options = frame_options();
    if (options.runs > 0 && !needs().tiles) tracer->expect(options.runs);
    if (settings.measure) tracer->count();
    if (settings.preview.of_picture()) preview.emplace(scene.programs(), settings, colors);
    if (settings.denoise) denoiser.emplace(scene.programs(), settings, colors, needs(), scene.buffers().needs());
    executor.measure(settings.measure);
    executor.compile_ahead(!page_rows && !needs().tiles);  // else, passes replace tables that kernels bind
    places.resize(1);
    compiled(0);
    std::size_t bytes = 0;
    for (const rays::BatchStatistics& batch : tracer->statistics()) bytes += batch.state_bytes;
    if (bytes > 0) states = std::clamp<std::size_t>(settings.state_bytes / bytes, 1, std::size_t(bands));
    own_sums = settings.in_turns;
    places.resize(own_sums ? std::size_t(bands) : states);
    scene.context().check("compiling the frame");
}

rays::ServedScene Renderer::State::served() const {
    return {scene.tables(), scene.trace(), scene.cull_tree(), settings.measure};
}

const paging::PageSource* Renderer::State::pages() const {
    return scene.pool() ? &scene.pool()->source() : nullptr;
}

FrameOptions Renderer::State::frame_options() const {
    FrameOptions options = halflight::frame_options(settings, scene.asked_estimator());
    options.native = offered_server != nullptr;
    return options;
}

FrameOptions Renderer::State::cached_options() const {
    FrameOptions options = frame_options();
    options.group_size = 1, options.group_size_piloted = false, options.radiance_cache = true;
    return options;
}

FrameOptions Renderer::State::listed_options() const {
    FrameOptions options = frame_options();
    options.group_size = 1, options.group_size_piloted = false, options.camera_rays = 1, options.want_hits = false;
    options.primary = PrimaryVisibility::traced;
    return options;
}

FrameNeeds Renderer::State::needs() const {
    return frame_needs(scene.buffers().needs(), frame_options());
}

Band Renderer::State::band_at(int index) const {
    Band where = band;
    where.y = index * band.rows;
    return where;
}

CompiledBand& Renderer::State::compiled(int index) {
    const std::size_t place = std::min(std::size_t(index), places.size() - 1);
    if (!places[place]) places[place] = compile(static_cast<std::uint32_t>(place));
    return *places[place];
}

std::unique_ptr<CompiledBand> Renderer::State::compile(std::uint32_t place) {
    std::shared_ptr<Mattes> mattes;
    if (place > 0 && !own_sums)
        mattes = compiled(0).mattes;
    else
        mattes = std::make_shared<Mattes>(scene.tables(), scene.object_names(), scene.material_names(), settings.aovs,
                                          band.paths(), pages());
    auto made = std::make_unique<CompiledBand>(std::move(mattes));
    compile(made->sample, place, 0, frame_options());
    if (settings.adaptive) {
        made->listed = std::make_unique<CompiledSample>();
        compile(*made->listed, place, 0, listed_options(), true);
        made->listed->adds_mattes = false;
    }
    if (cache) {
        made->cached = std::make_unique<CompiledSample>();
        compile(*made->cached, place, static_cast<std::uint32_t>(bands), cached_options());
    }
    add_data(*made, place);
    return made;
}

void Renderer::State::compile(CompiledSample& sample, std::uint32_t place, std::uint32_t further_sums,
                              const FrameOptions& options, bool listed) {
    SceneView own_view = view(sample.graph, place);
    if (listed) own_view.sampled_blocks = sample.graph.import_buffer("sampled blocks", *sampled_blocks);
    own_view.sums += further_sums;
    own_view.light_groups = static_cast<std::uint32_t>(options.light_groups);
    own_view.lens = lens;  // layers at the pixels' centres are those of a pinhole
    std::vector<graph::BufferHandle> constants;
    for (gpu::Buffer& of_seen : seen_constants)
        constants.push_back(sample.graph.import_buffer("constants of light seen", of_seen));
    sample.frame = add_frame(sample.graph, own_view, options, in_flight->bad_values(), constants, cache.get());
    sample.compiled = graph::compile(sample.graph);
}

void Renderer::State::add_data(CompiledBand& to, std::uint32_t place) {
    const bool aov =
        asked_for(settings, {LayerSource::record}) || settings.preview.temporal || neighbour_frames(settings) > 0;
    const DebugOptions debug{asked_for(settings, "nodes"), asked_for(settings, "culling"),
                             asked_for(settings, "residency")};
    const bool keep = settings.kept.is_everything();
    if (debug.any()) {
        const SceneView seen = view(to.debug_graph, place);
        const GBuffer gbuffer =
            add_gbuffer(to.debug_graph, seen, {.rays = true, .hits = debug.residency || keep}, settings.primary);
        to.debug_graph.output(to.debug = add_debug_aov(to.debug_graph, seen, gbuffer, debug));
        to.debug_data = graph::compile(to.debug_graph);
    }
    if (!aov) return;
    const SceneView seen = view(to.data_graph, place);
    const bool motion = asked_for(settings, "motion") || keep;
    const GBuffer gbuffer = add_gbuffer(to.data_graph, seen, {.rays = keep, .hits = true}, settings.primary);
    to.data_graph.output(to.aov = add_aov(to.data_graph, seen, gbuffer, motion));
    if (needs().chains && neighbour_frames(settings) > 0) {
        to.chains =
            add_specular_chains(to.data_graph, seen, gbuffer, {.bounces = bounces_of(settings), .places = true}).places;
        to.data_graph.output(to.chains);
    }
    to.data = graph::compile(to.data_graph);
}

SceneView Renderer::State::view(graph::Graph& graph, std::uint32_t place) {
    const graph::BufferHandle constants = graph.import_buffer("frame constants", frame_constants_buffer);
    const auto state = static_cast<std::uint32_t>(std::min<std::size_t>(place, states - 1));
    return {.programs = scene.programs(),
            .scene = scene.buffers(),
            .trace = scene.trace(),
            .tracer = *tracer,
            .band = band,
            .frame_constants = constants,
            .place = state,
            .current = &current,
            .sums = own_sums ? place : 0,
            .rows = page_rows.get(),
            .shadow_rays = static_cast<std::uint32_t>(settings.estimator.shadow),
            .group_size = static_cast<std::uint32_t>(settings.estimator.reuse),
            .optics = optics,
            .backfaces = settings.backfaces};
}

}  // namespace halflight
