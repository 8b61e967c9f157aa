#include "passes/render.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <span>

#include "engine/core/error.h"
#include "engine/graph/compile.h"
#include "engine/graph/execute.h"
#include "passes/aov.h"
#include "passes/composite.h"
#include "passes/cryptomatte.h"
#include "passes/film.h"
#include "passes/frame.h"
#include "passes/frame_constants.h"
#include "passes/hand_over.h"
#include "passes/preview_stage.h"
#include "passes/radiance_cache.h"
#include "passes/raster_window.h"
#include "passes/replicates.h"
#include "passes/reuse.h"
#include "shaders/shared/path.h"

namespace halflight {
namespace {

using Clock = std::chrono::steady_clock;

const std::initializer_list<std::string_view> kCentreAovs = {"position", "depth", "motion", "ids"};  // AovRecord

double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

constexpr const char* kNoErrorOfPreviews = "the error of a picture in a preview mode is not known";

void require(bool good, const char* what) {
    if (!good) throw Error("render settings", what);
}

void check(const FrameSettings& s) {
    require(s.samples > 0, "samples must be positive");
    require(s.first_sample >= 0 && s.first_sample <= std::numeric_limits<int>::max() - s.samples,
            "the first sample must not be negative, nor the last one beyond all numbers");
    require(
        s.camera.orthographic ? s.camera.ortho_height > 0 : s.camera.vertical_fov > 0 && s.camera.vertical_fov < kPi,
        "the camera's field of view is not between 0 and 180 degrees, or its height is not positive");
    require(s.filter.radius > 0 && s.filter.radius <= kMaxFilterRadius,
            "the filter's radius must be positive and at most 16 pixels");
    require(s.time_limit >= 0 && std::isfinite(s.time_limit), "the time limit must be zero or positive");
    if (!s.error) return;
    require(s.first_sample == 0, "a picture that is rendered to an error begins with the first sample");
    require(s.error->error > 0 && std::isfinite(s.error->error), "the error must be positive");
    require(s.samples >= kFirstLook * kReplicates, "there must be at least 16 samples to tell an error");
}

void check_all(const RenderSettings& s) {
    require(s.width > 0 && s.height > 0, "width and height must be positive");
    require(s.width <= 65536 && s.height <= 65536, "width and height must be at most 65536");
    require(s.bounces >= 0, "bounces must not be negative");
    require(s.clamp >= 0 && std::isfinite(s.clamp), "the clamp must be positive, or zero for none");
    check(s);
    require(!(s.error && s.preview.any()), kNoErrorOfPreviews);
    for (const std::string& name : s.aovs) {
        if (find_aov(name)) continue;
        std::string names;
        for (const AovInfo& a : known_aovs()) names += (names.empty() ? "" : ", ") + std::string(a.name);
        throw Error("render settings", "unknown AOV \"{}\"; there are: {}", name, names);
    }
}

/// Bands of whole block rows, as few as the driver's limits on buffers and textures allow, and all alike: each costs as
/// much as the largest.
Band first_band(const RenderSettings& s, const SceneBuffers& scene, std::size_t most_paths, const gpu::Limits& limits) {
    const std::size_t paths =
        std::min({s.band_pixels, most_paths, limits.storage_block_bytes / scene.widest_record_bytes()});
    const std::size_t row_paths = (static_cast<std::size_t>(s.width) + 15) / 16 * 256;  // of a row of blocks
    if (s.width > limits.texture_size)
        throw Error("render settings", "{} pixels wide: the driver takes {}", s.width, limits.texture_size);
    const int most =
        std::min(static_cast<int>(std::max<std::size_t>(paths / row_paths, 1)) * 16, limits.texture_size / 16 * 16);
    const ivec2 image(s.width, s.height);
    const int stride = window_stride(image);
    if (stride < s.height)
        return {image, 0, std::min(static_cast<int>(std::bit_floor(static_cast<unsigned>(most))), stride)};
    const int bands = (s.height + most - 1) / most;
    const int rows = ((s.height + bands - 1) / bands + 15) / 16 * 16;
    return {image, 0, std::min(rows, s.height)};
}

}  // namespace

/// A sample, and where it is added.
struct CompiledSample {
    graph::Graph graph;
    Frame frame;
    graph::CompiledGraph compiled;
    SumBuffers sums;  // once one was added
};

/// The graphs of a band, or of several that come one after the other.
struct CompiledBand {
    explicit CompiledBand(Mattes m) : mattes(std::move(m)) {}
    Mattes mattes;
    CompiledSample sample;
    std::unique_ptr<CompiledSample> cached;  // with the radiance cache; or none
    // AOVs through the pixels' centres; empty unless asked for
    graph::Graph data_graph;
    graph::BufferHandle aov;
    graph::BufferHandle debug;
    graph::CompiledGraph data;
};

struct Renderer::State {
    std::unique_ptr<PreparedScene> own;  // or none
    PreparedScene& scene;
    const ColorConfig colors;
    const RenderSettings asked;
    RenderSettings settings;  // with what the scene makes of them
    std::optional<rays::RasterCulling> raster;
    std::optional<rays::Tracer> tracer;
    std::optional<ViewKernel> view_kernel;
    std::optional<PreviewStage> preview;
    gpu::Buffer frame_constants_buffer{"frame constants", sizeof(shared::Frame)};
    std::vector<gpu::Buffer> seen_constants;                                        // of camera rays for light alone
    gpu::Buffer bad_values{"bad values", kBadValueCounts * sizeof(std::uint32_t)};  // of one sample
    std::shared_ptr<RadianceCache> cache;                                           // null without
    HandOver hand_over;
    BadValueSums bad_value_sums;
    Band band;
    Band current;  // of the constants
    int bands = 0;
    std::size_t states = 1;  // places in visibility state
    // Bands that have visibility state or, in turns, sums of their own; made when needed.
    std::vector<std::unique_ptr<CompiledBand>> places;
    graph::Executor executor;  // of samples: their sums and the visibility state are its history
    graph::Executor composer;
    bool told = false;  // what became of the hierarchies

    State(std::unique_ptr<PreparedScene> o, PreparedScene& s, const ColorConfig& c, std::optional<ViewKernel> view,
          RenderSettings r)
        : own(std::move(o)),
          scene(s),
          colors(c),
          asked(std::move(r)),
          settings(asked),
          view_kernel(std::move(view)),
          executor(scene.programs()),
          composer(scene.programs()) {
        if (settings.culling == rays::Culling::raster) {
            require(!scene.cull_tree().nodes.empty() || scene.tables().triangles.empty(),
                    "raster culling of a scene that was prepared without it");
            rays::RasterSettings raster_settings;
            raster_settings.measure = settings.measure;
            raster.emplace(scene.cull_tree(), raster_settings);
            tracer.emplace(scene.trace(), *raster);
        } else {
            tracer.emplace(scene.trace(), settings.culling);
        }
        settings.kept = scene.kept();
        settings.estimator = scene.estimator();
        settings.primary = resolved(settings.primary, scene.drawn_triangles(), ivec2(settings.width, settings.height));
        if (needs().seen)
            for (int i = 0; i < static_cast<int>(settings.estimator.camera); ++i)
                seen_constants.emplace_back("constants of light seen", sizeof(shared::Frame));
        if (settings.preview.cache && frame_needs(scene.buffers().needs(), cached_options()).radiance_cache)
            cache = settings.radiance_cache ? settings.radiance_cache : std::make_shared<RadianceCache>();
        const bool reuse = bool(needs().reuse);
        const gpu::Limits& limits = scene.context().limits();
        band = first_band(settings, scene.buffers(), reuse ? most_reuse_paths(*tracer, limits) : SIZE_MAX, limits);
        bands = (settings.height + band.rows - 1) / band.rows;
        const FrameOptions options = frame_options();
        if (options.runs > 0 && !needs().tiles) tracer->expect(options.runs);
        if (settings.measure) tracer->count();
        if (settings.preview.of_picture()) preview.emplace(scene.programs(), settings, colors);
        executor.measure(settings.measure);
        places.resize(1);
        compiled(0);
        std::size_t bytes = 0;
        for (const rays::BatchStatistics& batch : tracer->statistics()) bytes += batch.state_bytes;
        if (bytes > 0) states = std::clamp<std::size_t>(settings.state_bytes / bytes, 1, std::size_t(bands));
        places.resize(settings.in_turns ? std::size_t(bands) : states);
        scene.context().check("compiling the frame");
    }

    FrameOptions frame_options() const {
        return {.bounces = settings.bounces,
                .want_squares = asked_for(settings, {"variance"}) || settings.preview.of_picture(),
                .want_features = asked_for(settings, {"albedo", "normal"}) || settings.preview.of_picture(),
                .want_hits = asked_for(settings, {"cryptoobject", "cryptomaterial"}),
                .culling = settings.culling,
                .runs = std::uint64_t(settings.pictures) * std::uint64_t(settings.samples),
                .kept = settings.kept,
                .clamp = settings.clamp,
                .primary = settings.primary,
                .reuse = settings.estimator.reuse == Reuse::on,
                .camera_rays = static_cast<int>(settings.estimator.camera),
                .preview = settings.preview};
    }
    FrameOptions cached_options() const {
        FrameOptions options = frame_options();
        options.reuse = false, options.radiance_cache = true;
        return options;
    }
    FrameNeeds needs() const { return frame_needs(scene.buffers().needs(), frame_options()); }

    Band band_at(int index) const {
        Band where = band;
        where.y = index * band.rows;
        return where;
    }

    /// Of band number `index`.
    CompiledBand& compiled(int index) {
        const std::size_t place = std::min(std::size_t(index), places.size() - 1);
        if (!places[place]) places[place] = compile(static_cast<std::uint32_t>(place));
        return *places[place];
    }

    std::unique_ptr<CompiledBand> compile(std::uint32_t place) {
        auto made = std::make_unique<CompiledBand>(
            Mattes(scene.tables(), scene.object_names(), scene.material_names(), settings.aovs, band.paths()));
        compile(made->sample, place, 0, frame_options());
        if (cache) {
            made->cached = std::make_unique<CompiledSample>();
            compile(*made->cached, place, settings.in_turns ? static_cast<std::uint32_t>(bands) : 1, cached_options());
        }
        add_data(*made, place);
        return made;
    }

    /// further_sums: how many sums are not its own.
    void compile(CompiledSample& sample, std::uint32_t place, std::uint32_t further_sums, const FrameOptions& options) {
        SceneView own_view = view(sample.graph, place);
        own_view.sums += further_sums;
        own_view.radiance_cache = cache.get();
        std::vector<graph::BufferHandle> constants;
        for (gpu::Buffer& of_seen : seen_constants)
            constants.push_back(sample.graph.import_buffer("constants of light seen", of_seen));
        sample.frame = add_frame(sample.graph, own_view, options, bad_values, constants);
        sample.compiled = graph::compile(sample.graph);
    }

    void add_data(CompiledBand& to, std::uint32_t place) {
        const bool aov = asked_for(settings, kCentreAovs) || settings.preview.of_picture();
        const DebugOptions debug{asked_for(settings, {"nodes"}), asked_for(settings, {"culling"})};
        if (!aov && !debug.nodes && !debug.culling) return;
        const SceneView seen = view(to.data_graph, place);
        const bool keep = settings.kept.is_everything();
        const bool motion = asked_for(settings, {"motion"}) || keep;
        const GBuffer gbuffer = add_gbuffer(
            to.data_graph, seen, {.rays = debug.nodes || debug.culling || keep, .hits = aov || keep}, settings.primary);
        if (aov) to.data_graph.output(to.aov = add_aov(to.data_graph, seen, gbuffer, motion));
        if (debug.nodes || debug.culling)
            to.data_graph.output(to.debug = add_debug_aov(to.data_graph, seen, gbuffer, debug));
        to.data = graph::compile(to.data_graph);
    }

    SceneView view(graph::Graph& graph, std::uint32_t place) {
        const graph::BufferHandle constants = graph.import_buffer("frame constants", frame_constants_buffer);
        const auto state = static_cast<std::uint32_t>(std::min<std::size_t>(place, states - 1));
        return {scene.programs(),
                scene.buffers(),
                scene.trace(),
                *tracer,
                band,
                constants,
                state,
                &current,
                settings.in_turns ? place : 0};
    }

    void look(const FrameSettings& frame, const SampleView& at) {
        const shared::Frame constants = frame_constants(frame, scene.tables(), at);
        frame_constants_buffer.write(0, sizeof(constants), &constants);
        current = at.band;
    }

    /// Sample number `done` of a picture, from 0.
    void add_sample(const FrameSettings& frame, const Band& where, int done, CompiledBand& with) {
        const int cached = with.cached ? kCachedSamples : 0;
        if (done < cached) {
            const std::uint32_t first = (cache->picture() - 1) * kCachedSamples;
            const auto index = static_cast<std::uint32_t>(done);
            add_sample(frame, cached_view(frame, where, first, index, settings.estimator.sampler), with, *with.cached);
        } else {
            if (done == cached) with.mattes.clear();
            const auto index = static_cast<std::uint32_t>(frame.first_sample + done - cached);
            add_sample(frame, sample_view(frame, where, index, settings.estimator.sampler), with, with.sample);
        }
    }

    void add_sample(const FrameSettings& frame, const SampleView& at, CompiledBand& with, CompiledSample& sample) {
        look(frame, at);
        const int seen = static_cast<int>(seen_constants.size());
        for (int i = 0; i < seen; ++i) {
            const shared::Frame constants =
                frame_constants(frame, scene.tables(), seen_view(at, frame.filter, i, seen));
            seen_constants[std::size_t(i)].write(0, sizeof(constants), &constants);
        }
        bad_values.clear();
        executor.run(sample.compiled);
        glFinish();
        const Accumulated& a = sample.frame.sums;
        const auto buffer = [&](graph::BufferHandle h) { return h ? &executor.buffer(h) : nullptr; };
        sample.sums = {buffer(a.emission), buffer(a.direct), buffer(a.indirect), buffer(a.squares), buffer(a.features)};
        bad_value_sums.add(std::span<const std::uint32_t, kBadValueCounts>(bad_values.read<std::uint32_t>()));
        scene.context().check("rendering");
        if (!with.mattes.empty()) with.mattes.add(executor.read<shared::Hit>(sample.frame.gbuffer.hits));
    }

    /// Told how many samples of a band are done, and how many there will be as far as is known; false: stop.
    using AfterSample = std::function<bool(int done, int total)>;

    /// Adds samples to a band until there are enough, time is up, or the callback says stop. Returns how many.
    int render_band(const FrameSettings& frame, const Band& where, CompiledBand& with, double time_limit,
                    const AfterSample& after_sample) {
        const Clock::time_point start = Clock::now();
        for (int done = 1;; ++done) {
            add_sample(frame, where, done - 1, with);
            const bool go_on = after_sample(done, frame.samples);
            if (!go_on || done == frame.samples) return done;
            // Another sample like those so far would end late.
            if (time_limit > 0 && seconds_since(start) * (done + 1) / done > time_limit) return done;
        }
    }

    /// The same until the band's error is below the target, too, which is then below it in the whole picture. Adds what
    /// it knows of the error to that of the picture.
    int render_band_to_error(const FrameSettings& frame, const Band& where, CompiledBand& with, double time_limit,
                             const AfterSample& after_sample, PictureError& picture_error) {
        const Clock::time_point start = Clock::now();
        const int most = std::min(frame.samples / kReplicates, kMostReplicateSamples);
        BandReplicates replicates(where);
        int done = 0;
        int each = 0;  // samples of a replicate
        for (int next = kFirstLook; next > each;) {
            for (int r = 0; r < kReplicates; ++r) {
                for (int i = each; i < next; ++i) {
                    add_sample(frame, replicate_view(frame, where, r, i, settings.estimator.sampler), with,
                               with.sample);
                    if (!after_sample(++done, next * kReplicates)) return done;
                }
                replicates.add(r, light(with.sample.sums));
            }
            each = next;
            const ErrorEstimate estimate = replicates.error(frame.error->metric, each).estimate();
            if (estimate.bound <= frame.error->error) break;
            next = std::min(next_replicate_samples(each, estimate, frame.error->error), most);
            if (time_limit > 0)
                next = static_cast<int>(std::min<double>(next, each * time_limit / seconds_since(start)));
        }
        picture_error.add(replicates.error(frame.error->metric, each));
        return done;
    }

    /// Adds samples to all bands in turns, until there are enough, time is up, or the callback says stop; it is told of
    /// each band by itself. `done`: samples of each.
    void render_in_turns(const FrameSettings& frame, double time_limit, std::vector<int>& done,
                         const std::function<bool()>& after_sample) {
        const Clock::time_point start = Clock::now();
        for (int b = 0; b < bands; ++b) compiled(b).mattes.clear();
        for (int i = 0; i < frame.samples; ++i) {
            for (int b = 0; b < bands; ++b) {
                add_sample(frame, band_at(b), i, compiled(b));
                done[std::size_t(b)] = i + 1;
                if (!after_sample()) return;
            }
            if (time_limit > 0 && seconds_since(start) * (i + 2) / (i + 1) > time_limit) return;
        }
    }

    static std::vector<double> read(const gpu::Buffer* b) { return b ? b->read<double>() : std::vector<double>{}; }
    static Film::Sums light(const SumBuffers& sums) {
        return {read(sums.emission), read(sums.direct), read(sums.indirect), {}, {}};
    }

    void develop(const FrameSettings& frame, const Band& where, const CompiledBand& with, int done, Film& film) {
        const auto [sums, samples, mattes] =
            hand_over.shown(composer, with.cached ? &with.cached->sums : nullptr, with.sample.sums, done);
        Film::Sums all;
        if (film.wants(
                {"emission", "direct_diffuse", "direct_glossy", "indirect_diffuse", "indirect_glossy", "variance"}))
            all = light(sums);
        if (film.wants({"variance"})) all.squares = read(sums.squares);
        if (film.wants({"albedo", "normal"})) all.features = read(sums.features);
        film.add_sums(where, samples, all);
        for (const Mattes::Layer& layer : with.mattes.layers()) film.add_ids(where, mattes, layer.aov, layer.coverage);

        const bool data = with.aov && (preview || film.wants(kCentreAovs));
        const bool debug = with.debug && film.wants({"nodes", "culling"});
        if (data || debug) {
            SampleView centres = sample_view(frame, where, 0, SamplePoints::sobol);
            centres.jitter = vec2(0.5f);
            look(frame, centres);
            executor.run(with.data);
        }

        graph::Graph graph;
        const auto import = [&](gpu::Buffer* b) { return b ? graph.import_buffer("sums", *b) : graph::BufferHandle{}; };
        Accumulated imported;
        imported.emission = import(sums.emission);
        imported.direct = import(sums.direct);
        imported.indirect = import(sums.indirect);
        const Composite composite = add_composite(graph, band, imported, samples, scene.has_environment(),
                                                  view_kernel ? &*view_kernel : nullptr);
        graph.output(composite.beauty);
        if (composite.view) graph.output(composite.view);
        if (preview) {
            imported.squares = import(sums.squares);
            imported.features = import(sums.features);
            preview->add_band(graph, where, imported, graph.import_buffer("aov records", executor.buffer(with.aov)),
                              composite.beauty, samples);
        }
        composer.run(graph::compile(graph));
        film.add_pictures(where, composer.texture(composite.beauty).read_float(),
                          composite.view ? composer.texture(composite.view).read_float() : std::vector<float>{});

        if (with.aov && (film.wants(kCentreAovs) || (preview && frame.previous_surfaces))) {
            const auto records = executor.read<shared::AovRecord>(with.aov);
            film.add_data(where, records);
            if (frame.previous_surfaces)
                film.add_surface_motion(where, records, *frame.previous_surfaces,
                                        frame.previous_camera.value_or(frame.camera));
            if (frame.previous_surfaces && preview)
                preview->add_motion(where, records, scene.tables(), *frame.previous_surfaces);
        }
        if (debug) film.add_debug(where, executor.read<shared::DebugRecord>(with.debug));
    }

    /// After all bands were developed.
    void apply_preview(const FrameSettings& frame, std::span<const int> samples, Film& film) {
        const int least = *std::ranges::min_element(samples);
        if (preview && least > 0) preview->apply(frame, scene.tables(), least, film);
    }

    /// Of bands whose sums are there; `samples`: of each.
    void develop(const FrameSettings& frame, std::span<const int> samples, Film& film) {
        for (int b = 0; b < bands; ++b)
            if (samples[std::size_t(b)] > 0) develop(frame, band_at(b), compiled(b), samples[std::size_t(b)], film);
    }

    /// Takes the film's pictures, and tells what there is to tell of them and of how they came about.
    void finish(RenderResult& result, Film& film, std::span<const int> samples, Clock::time_point start,
                double compiled_before) {
        const CompiledBand& first = compiled(0);
        for (const Mattes::Layer& layer : first.mattes.layers())
            if (film.wants({layer.aov}))
                result.attributes.merge(cryptomatte_attributes(cryptomatte_layer(layer.aov), layer.names));
        film.take(result);
        RenderStats& stats = result.stats;
        stats.samples = *std::ranges::min_element(samples);
        for (int b = 0; b < bands; ++b)
            stats.paths += std::uint64_t(std::min(band.rows, settings.height - b * band.rows)) *
                           std::uint64_t(settings.width) * std::uint64_t(samples[std::size_t(b)]);
        stats.compile_seconds = scene.programs().seconds() - compiled_before;
        stats.render_seconds = seconds_since(start) - stats.compile_seconds;
        stats.prepare_seconds = scene.seconds();
        stats.hierarchies = scene.hierarchies();
        if (rays::HierarchyCounts& h = stats.hierarchies; told) h = {.kept = h.kept + h.refitted + h.built};
        stats.estimator = settings.estimator;
        stats.estimator.reuse = needs().reuse ? Reuse::on : Reuse::off;
        stats.primary = settings.primary;
        if (cache && settings.measure) stats.radiance_cache = cache->statistics();
        const std::size_t pictures =
            (view_kernel ? 2 : 1) * sizeof(vec4) * std::size_t(band.image.x) * std::size_t(band.rows);
        stats.gpu_bytes = scene.bytes() + executor.history().bytes() + pictures + (cache ? cache->bytes() : 0) +
                          std::max({first.sample.compiled.slot_bytes, first.data.slot_bytes,
                                    first.cached ? first.cached->compiled.slot_bytes : 0});
        const TraceTables& tables = scene.tables();
        stats.left_out = left_out(scene.buffers().needs(), cache ? cached_options() : frame_options(),
                                  {tables.positions.size(), tables.triangles.size(), band.paths(),
                                   std::size_t(settings.width) * std::size_t(settings.height)});
        for (const graph::PassTime& t : executor.times()) stats.passes.push_back({t.name, t.count, t.seconds});
        stats.batches = tracer->statistics();
        if (raster) stats.raster = raster->batches();
        stats.bad_values = bad_value_sums.told();
        if (preview) preview->tell(stats);
        if (settings.clamp > 0 && settings.bounces > 1)
            stats.biases.push_back(
                fmt::format("indirect light clamped to a luminance of {:g} per sample", settings.clamp));
        if (const double weight = cache ? cached_weight(stats.samples) : 0; weight > 0)
            stats.biases.push_back(fmt::format("preview: {:.0f} % of it by a radiance cache, none from {} samples on",
                                               100 * weight, kHandedOver));
    }
};

namespace {

std::optional<ViewKernel> view_kernel(const ColorConfig& colors, const RenderSettings& settings) {
    if (!settings.want_view) return std::nullopt;
    return std::optional<ViewKernel>(colors.view(settings.view));
}

}  // namespace

Renderer::Renderer(PreparedScene& scene, const ColorConfig& colors, RenderSettings settings) {
    check_all(settings);
    state_ = std::make_unique<State>(nullptr, scene, colors, view_kernel(colors, settings), settings);
}

Renderer::Renderer(gpu::Context& context, const Scene& scene, const ColorConfig& colors,
                   const RenderSettings& settings) {
    check_all(settings);
    const bool raster = settings.culling == rays::Culling::raster;
    auto own =
        std::make_unique<PreparedScene>(context, scene, PrepareOptions{raster, settings.kept, settings.estimator});
    PreparedScene& prepared = *own;
    state_ = std::make_unique<State>(std::move(own), prepared, colors, view_kernel(colors, settings), settings);
}

Renderer::Renderer(Renderer&&) noexcept = default;
Renderer::~Renderer() = default;

void Renderer::update(const Scene& scene) {
    State& s = *state_;
    assert(s.own);
    if (s.cache) s.cache->clear();
    if (s.scene.update(scene)) {
        if (s.raster) s.raster->set_tree(s.scene.cull_tree());
        s.told = false;
        return;
    }
    PreparedScene& prepared = s.scene;
    state_ = std::make_unique<State>(std::move(s.own), prepared, s.colors, std::move(s.view_kernel), s.asked);
}

void Renderer::forget(std::string reason) {
    state_->executor.history().invalidate(std::move(reason));
    state_->tracer->invalidate();
    if (state_->cache) state_->cache->clear();
}

RenderResult Renderer::render(const ProgressCallback& progress) {
    return render(state_->settings, progress);
}

RenderResult Renderer::render(const FrameSettings& frame, const ProgressCallback& progress) {
    check(frame);
    State& s = *state_;
    require(!(frame.error && s.settings.preview.any()), kNoErrorOfPreviews);
    const Clock::time_point start = Clock::now();
    const double compiled_before = s.scene.programs().seconds();
    s.executor.reset_times();
    s.tracer->reset_statistics();
    s.bad_value_sums.reset();
    if (s.preview) s.preview->begin(frame.history);
    if (s.cache) s.cache->begin_picture(s.scene.programs());

    RenderResult result;
    RenderStats& stats = result.stats;
    Film film(s.settings, s.scene.tables());
    PictureError error;
    std::vector<int> done(std::size_t(s.bands));  // samples, by band
    const bool in_turns = s.settings.in_turns && !frame.error;
    const bool sums_are_there = !frame.error && (in_turns || s.bands == 1);
    /// all: samples of all bands, as far as is known.
    const auto go_on = [&](std::int64_t all) {
        if (!progress) return true;
        const auto sum = std::accumulate(done.begin(), done.end(), std::int64_t{0});
        RenderProgress told{static_cast<int>(sum / s.bands), static_cast<int>(all / s.bands), seconds_since(start)};
        if (sums_are_there && std::ranges::count(done, done[0]) == s.bands) {
            told.picture = [&](const std::vector<std::string>& aovs) {
                RenderResult so_far;
                Film own(s.settings, s.scene.tables());
                own.choose(aovs);
                s.develop(frame, done, own);
                s.apply_preview(frame, done, own);
                s.finish(so_far, own, done, start, compiled_before);
                return so_far;
            };
        }
        stats.interrupted = !progress(told);
        return !stats.interrupted;
    };
    if (in_turns) {
        s.render_in_turns(frame, frame.time_limit, done, [&] { return go_on(std::int64_t{frame.samples} * s.bands); });
        s.develop(frame, done, film);
    } else {
        std::int64_t samples_before = 0;
        for (int b = 0; b < s.bands && !stats.interrupted; ++b) {
            CompiledBand& with = s.compiled(b);
            with.mattes.clear();
            const Band where = s.band_at(b);
            const double time_left =
                frame.time_limit > 0 ? std::max((frame.time_limit - seconds_since(start)) / (s.bands - b), 1e-9) : 0.0;
            int& of_band = done[std::size_t(b)];
            const auto after_sample = [&](int samples, int total) {
                of_band = samples;
                return go_on(samples_before + std::int64_t{total} * (s.bands - b));
            };
            of_band = frame.error ? s.render_band_to_error(frame, where, with, time_left, after_sample, error)
                                  : s.render_band(frame, where, with, time_left, after_sample);
            samples_before += of_band;
            s.develop(frame, where, with, of_band, film);
        }
    }
    s.apply_preview(frame, done, film);
    s.scene.context().check("rendering");
    s.finish(result, film, done, start, compiled_before);
    s.told = true;
    if (frame.error && !stats.interrupted) {
        const ErrorEstimate estimate = error.estimate();
        stats.error = {*frame.error, estimate, estimate.bound <= frame.error->error};
    }
    return result;
}

const char* name(ErrorMetric metric) {
    return metric == ErrorMetric::mse ? "mse" : "relmse";
}

std::string Renderer::graph_dot() const {
    return graph::to_dot(state_->compiled(0).sample.compiled);
}

}  // namespace halflight
