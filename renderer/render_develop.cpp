#include <algorithm>

#include "engine/core/error.h"
#include "engine/core/interruption.h"
#include "passes/picture/shadow_catcher.h"
#include "renderer/frame_options.h"
#include "renderer/render_state.h"

namespace halflight {

void Renderer::State::develop(const FrameSettings& frame, int index, int done, Film& film) {
    const Band where = bands.at(index);
    const CompiledBand& with = compiled(index);
    interruption_point();
    in_flight->drain();
    const auto [sums, samples, mattes, first_half] =
        hand_over.shown(composer, cache ? &with.cached_sums : nullptr, with.sums, done);
    Film::Sums all;
    using Source = LayerSource;
    if (film.wants({Source::emission, Source::direct, Source::indirect, Source::squares})) all = light(sums);
    if (film.wants({Source::squares})) all.squares = read(sums.squares);
    if (film.wants({Source::groups})) all.groups = read(sums.groups);
    if (film.wants({Source::features})) all.features = read(sums.features);
    const bool opaque_background = scene.has_environment() && !settings.transparent;
    interruption_point();
    film.add_sums(where, samples, all);
    interruption_point();
    if (!with.samples.empty()) film.add_sample_counts(where, with.samples);
    for (const Mattes::Layer& layer : with.mattes->layers())
        film.add_ids(where, with.first_samples > 0 ? with.first_samples : mattes, layer.aov->name, layer.coverage);

    const bool reprojects = settings.preview.temporal;
    const bool data = with.graphs.aov && (reprojects || inputs.noisy || film.wants({Source::record}));
    const bool debug = with.graphs.debug && film.wants({Source::debug});
    if (data || debug) {
        // The pages of residency are those of the samples, so the debug layers come first.
        SampleView centres = sample_view(frame, where, 0, SamplePoints::sobol);
        centres.jitter = vec2(0.5f);
        set_pose(frame, std::nullopt);
        upload_constants(frame, centres);
        if (debug) {
            executor.run(with.graphs.debug_data);
            film.add_debug(where, executor.read<shared::DebugRecord>(with.graphs.debug));
        }
        if (data) executor.run(with.graphs.data);
    }

    graph::Graph graph;
    const Accumulated all_sums = imported(graph, sums);
    const Composite composite = add_composite(graph, bands.first, all_sums, samples, opaque_background,
                                              view_kernel ? &*view_kernel : nullptr, settings.transparent);
    graph.output(composite.beauty);
    if (composite.view) graph.output(composite.view);
    if (preview) {
        const graph::BufferHandle records =
            reprojects ? graph.import_buffer("aov records", executor.buffer(with.graphs.aov)) : graph::BufferHandle{};
        preview->add_band(graph, where, all_sums, records, composite.beauty, {double(samples), first_half});
    }
    if (denoiser) denoiser->add_band(graph, where, all_sums, composite.beauty, {samples, sums.first_half});
    composer.run(graph::compile(graph));
    film.add_pictures(where, composer.texture(composite.beauty).read_float(),
                      composite.view ? composer.texture(composite.view).read_float() : std::vector<float>{});

    if (with.graphs.aov && (film.wants({Source::record}) || inputs.noisy || (reprojects && inputs.previous_surfaces))) {
        const auto records = executor.read<shared::AovRecord>(with.graphs.aov);
        film.add_data(where, records);
        if (inputs.noisy) {
            const auto chains = with.graphs.chains ? executor.read<shared::ChainPlace>(with.graphs.chains)
                                                   : std::vector<shared::ChainPlace>();
            inputs.noisy->add_places(where, records, chains, scene.tables());
        }
        if (inputs.previous_surfaces)
            film.add_surface_motion(where, records, *inputs.previous_surfaces, frame.camera,
                                    frame.previous_camera.value_or(frame.camera));
        if (inputs.previous_surfaces && reprojects)
            preview->add_motion(where, records, scene.tables(), *inputs.previous_surfaces);
    }
}

void Renderer::State::apply_to_picture(const FrameSettings& frame, std::span<const int> samples, Film& film) {
    film.keep_noisy();
    const int least = *std::ranges::min_element(samples);
    if (denoiser && !frame.stays_noisy) denoiser->apply(film, least > 0);
    if (preview && least > 0) preview->apply(frame, scene.tables(), least, film);
}

void Renderer::State::finish(RenderResult& result, Film& film, const FrameSettings& frame, std::span<const int> samples,
                             const Stopwatch& watch, double compiled_before) {
    const CompiledBand& first = compiled(0);
    for (const Mattes::Layer& layer : first.mattes->layers())
        if (film.wants({layer.aov->source}))
            result.attributes.merge(cryptomatte_attributes(layer.aov->prefix, layer.names));
    const PixelWindow wanted = data_window(asked);
    film.take(result, wanted.first - bands.first.origin, wanted.size());
    RenderStats& stats = result.stats;
    stats.samples = *std::ranges::min_element(samples);
    for (int b = 0; b < bands.count; ++b)
        stats.paths += std::uint64_t(std::min(bands.first.rows, settings.height - b * bands.first.rows)) *
                       std::uint64_t(settings.width) * std::uint64_t(samples[std::size_t(b)]);
    stats.compile_seconds = scene.programs().seconds() - compiled_before;
    stats.render_seconds = watch.seconds() - stats.compile_seconds;
    stats.prepare_seconds = scene.seconds();
    stats.hierarchies = scene.hierarchies();
    if (rays::HierarchyCounts& h = stats.hierarchies; hierarchies_reported) h = {.kept = h.kept + h.refitted + h.built};
    stats.estimator = settings.estimator;
    stats.estimator.sampler = points_of(frame, settings.estimator.sampler);
    if (!needs().reuse) stats.estimator.reuse = Reuse::off;
    stats.primary = settings.primary;
    if (options.lens) stats.lens = frame.camera.lens;
    if (cache && settings.measure) stats.radiance_cache = cache->statistics();
    const std::size_t pictures =
        (view_kernel ? 2 : 1) * sizeof(vec4) * std::size_t(bands.first.image.x) * std::size_t(bands.first.rows);
    stats.gpu_bytes = scene.bytes() + executor.history().bytes() + pictures + (cache ? cache->bytes() : 0) +
                      first.graphs.transient_bytes();
    const TraceTables& tables = scene.tables();
    stats.left_out = left_out(scene.buffers().needs(), cache ? cached_options(options) : options,
                              {tables.vertex_count(), tables.triangles.size(), bands.first.paths(),
                               std::size_t(settings.width) * std::size_t(settings.height)});
    for (const graph::PassTime& t : executor.times()) stats.passes.push_back({t.name, t.count, t.seconds});
    servers.fill_stats(stats);
    if (const paging::TilePool* tiles = scene.buffers().tiles()) stats.textures = tiles->statistics();
    stats.bad_values = in_flight->counted().by_component();
    if (preview) preview->fill_stats(stats);
    if (denoiser) denoiser->fill_stats(stats);
    if (scene.buffers().needs().texture_levels)
        stats.layer_biases.emplace_back("textures: mip levels by ray footprint");
    if (scene.buffers().needs().solid_panes)
        stats.layer_biases.emplace_back("light passes solid glass straight on (straight_shadows)");
    if (scene.buffers().needs().light_links)
        stats.layer_biases.emplace_back("lights leave out objects (light links)");
    if (settings.clamp > 0 && bounces_of(settings) > 1)
        stats.layer_biases.push_back(
            fmt::format("indirect light clamped to a luminance of {:g} per sample", settings.clamp));
    if (const double weight = cache ? cached_weight(stats.samples) : 0; weight > 0)
        stats.layer_biases.push_back(
            fmt::format("preview: {:.0f} % of the light comes from the radiance cache, none from {} samples on",
                        100 * weight, kHandedOver));
    stats.biases.insert(stats.biases.end(), stats.layer_biases.begin(), stats.layer_biases.end());
}

}  // namespace halflight
