#include <fmt/ranges.h>

#include <algorithm>
#include <cstdint>

#include "engine/core/error.h"
#include "engine/rays/batch_server.h"
#include "renderer/band_size.h"
#include "renderer/frame_options.h"
#include "renderer/render_state.h"
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
    settings.primary =
        resolved(settings.primary, scene.drawn_triangles(), ivec2(settings.width, settings.height),
                 shown_by_tracing(settings.camera.optics, settings.camera.lens.blurs(), has_overscan(asked)));
    options = frame_options(settings, scene.asked_estimator());
    options.native = offered_server != nullptr;
    if (needs().seen)
        for (int i = 0; i < options.camera_rays; ++i)
            seen_constants.emplace_back("constants of light seen", sizeof(shared::Frame));
    if (settings.preview.cache && frame_needs(scene.buffers().needs(), cached_options(options)).radiance_cache)
        cache = given_cache ? given_cache : std::make_shared<RadianceCache>();
    const gpu::Limits& limits = scene.context().limits();
    check_denoiser_windows(asked, limits.texture_size);
    // Tile lists count for every method, so that bands do not depend on it.
    const std::size_t most = most_paths(graph_inputs(), rays::Culling::compute, limits);
    band = first_band(asked, std::min(asked.band_pixels, most), limits.texture_size);
    if (band.paths() > most_paths(graph_inputs(), rays::Culling::off, limits))
        throw Error("render settings",
                    "{} pixels wide{}: the driver's storage blocks hold {} bytes (--crop renders parts)", band.image.x,
                    options.light_groups > 0 ? fmt::format(" with {} light groups", options.light_groups) : "",
                    limits.storage_block_bytes);
    // From here on, the rendered pixels are the picture; finish() cuts out those that were asked for.
    settings.width = band.image.x, settings.height = band.image.y;
    settings.crop.reset(), settings.overscan = 0;
    bands = (settings.height + band.rows - 1) / band.rows;
    in_flight.emplace(band.paths());
    if (settings.adaptive) {
        settings.in_turns = false;
        sampled_blocks.emplace("sampled blocks", band.paths() / 256 * sizeof(shared::SampledBlock));
    }
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

GraphInputs Renderer::State::graph_inputs() {
    return {.programs = scene.programs(),
            .scene = scene.buffers(),
            .trace = scene.trace(),
            .tracer = &*tracer,
            .settings = settings,
            .options = options,
            .frame_constants = frame_constants_buffer,
            .seen_constants = seen_constants,
            .bad_values = in_flight ? &in_flight->bad_values() : nullptr,
            .sampled_blocks = sampled_blocks ? &*sampled_blocks : nullptr,
            .cache = cache.get(),
            .rows = page_rows.get(),
            .current = &current};
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
    const std::uint32_t sums = own_sums ? place : 0;
    const BandPlace at{static_cast<std::uint32_t>(std::min<std::size_t>(place, states - 1)), sums,
                       sums + static_cast<std::uint32_t>(bands)};
    return std::make_unique<CompiledBand>(graph_inputs(), band, at, std::move(mattes));
}

}  // namespace halflight
