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

/// Returns a scene that renderers can be made for.
PreparedScene& usable(PreparedScene& scene) {
    if (leaves_open(scene.estimator()))
        throw Error("render settings", "the estimator is left open: a pilot has to settle it first");
    scene.check_usable();
    return scene;
}

}  // namespace

Renderer::State::State(std::unique_ptr<PreparedScene> o, PreparedScene& s, const ColorConfig& c,
                       std::optional<ViewKernel> view, RenderSettings r, rays::BatchServer* callers_server,
                       std::shared_ptr<RadianceCache> callers_cache)
    : own(std::move(o)),
      scene(usable(s)),
      colors(c),
      asked(std::move(r)),
      settings(asked),
      given_cache(std::move(callers_cache)),
      servers(scene, settings, callers_server),
      executor(scene.programs()),
      composer(scene.programs()),
      view_kernel(std::move(view)) {
    check_light_groups(settings, scene.light_groups());
    settings.kept = scene.kept();
    settings.estimator = scene.estimator();
    // Blue noise needs a number of samples that all pixels share.
    if (SamplePoints& points = settings.estimator.sampler; settings.adaptive && points == SamplePoints::blue_noise)
        points = SamplePoints::sobol;
    settings.primary =
        resolved(settings.primary, scene.drawn_triangles(), ivec2(settings.width, settings.height),
                 shown_by_tracing(settings.camera.optics, settings.camera.lens.blurs(), has_overscan(asked)));
    options = frame_options(settings, scene.asked_estimator());
    options.native = servers.offered != nullptr;
    if (needs().seen)
        for (int i = 0; i < options.camera_rays; ++i)
            sample.seen.emplace_back("constants of light seen", sizeof(shared::Frame));
    if (settings.preview.cache && frame_needs(scene.buffers().needs(), cached_options(options)).radiance_cache)
        cache = given_cache ? given_cache : std::make_shared<RadianceCache>();
    const gpu::Limits& limits = scene.context().limits();
    check_denoiser_windows(asked, limits.texture_size);
    // Tile lists count for every method, so that bands do not depend on it.
    const std::size_t most = most_paths(graph_inputs(), rays::Culling::compute, limits);
    bands.first = first_band(asked, std::min(asked.band_pixels, most), limits.texture_size);
    if (bands.first.paths() > most_paths(graph_inputs(), rays::Culling::off, limits))
        throw Error("render settings",
                    "{} pixels wide{}: the driver's storage blocks hold {} bytes (--crop renders parts)",
                    bands.first.image.x,
                    options.light_groups > 0 ? fmt::format(" with {} light groups", options.light_groups) : "",
                    limits.storage_block_bytes);
    // From here on, the rendered pixels are the picture; finish() cuts out those that were asked for.
    settings.width = bands.first.image.x, settings.height = bands.first.image.y;
    settings.crop.reset(), settings.overscan = 0;
    bands.count = (settings.height + bands.first.rows - 1) / bands.first.rows;
    in_flight.emplace(bands.first.paths());
    if (settings.adaptive) {
        settings.in_turns = false;
        sample.blocks.emplace("sampled blocks", bands.first.paths() / 256 * sizeof(shared::SampledBlock));
    }
    if (options.runs > 0 && !needs().tiles) servers.tracer->expect(options.runs);
    if (settings.measure) servers.tracer->count();
    if (settings.preview.of_picture()) preview.emplace(scene.programs(), settings, colors);
    if (has_halves(settings)) denoiser.emplace(scene.programs(), settings, colors, needs(), scene.buffers().needs());
    executor.measure(settings.measure);
    executor.compile_ahead(!servers.rows && !needs().tiles);  // else, passes replace tables that kernels bind
    bands.places.resize(1);
    compiled(0);
    std::size_t bytes = 0;
    for (const rays::BatchStatistics& batch : servers.tracer->statistics()) bytes += batch.state_bytes;
    if (bytes > 0) bands.states = std::clamp<std::size_t>(settings.state_bytes / bytes, 1, std::size_t(bands.count));
    bands.own_sums = settings.in_turns;
    bands.places.resize(bands.own_sums ? std::size_t(bands.count) : bands.states);
    scene.context().check("compiling the frame");
}

const paging::PageSource* Renderer::State::pages() const {
    return scene.pool() ? &scene.pool()->source() : nullptr;
}

GraphInputs Renderer::State::graph_inputs() {
    return {.programs = scene.programs(),
            .scene = scene.buffers(),
            .trace = scene.trace(),
            .tracer = &*servers.tracer,
            .settings = settings,
            .options = options,
            .frame_constants = sample.frame,
            .seen_constants = sample.seen,
            .bad_values = in_flight ? &in_flight->bad_values() : nullptr,
            .sampled_blocks = sample.blocks ? &*sample.blocks : nullptr,
            .cache = cache.get(),
            .rows = servers.rows.get(),
            .current = &sample.band};
}

Band Bands::at(int index) const {
    Band where = first;
    where.y = index * first.rows;
    return where;
}

void Bands::keep_sums() {
    if (own_sums || count == 1) return;
    own_sums = true;
    places.resize(1);  // the first band has sums of its own in any case
    places.resize(std::size_t(count));
}

CompiledBand& Renderer::State::compiled(int index) {
    const std::size_t place = std::min(std::size_t(index), bands.places.size() - 1);
    std::unique_ptr<CompiledBand>& made = bands.places[place];
    if (!made) made = compile(static_cast<std::uint32_t>(place));
    return *made;
}

std::unique_ptr<CompiledBand> Renderer::State::compile(std::uint32_t place) {
    std::shared_ptr<Mattes> mattes;
    if (place > 0 && !bands.own_sums)
        mattes = compiled(0).mattes;
    else
        mattes = std::make_shared<Mattes>(scene.tables(), scene.object_names(), scene.material_names(), settings.aovs,
                                          bands.first.paths(), pages());
    const std::uint32_t sums = bands.own_sums ? place : 0;
    const BandPlace at{static_cast<std::uint32_t>(std::min<std::size_t>(place, bands.states - 1)), sums,
                       sums + static_cast<std::uint32_t>(bands.count)};
    return std::make_unique<CompiledBand>(graph_inputs(), bands.first, at, std::move(mattes));
}

}  // namespace halflight
