#include "passes/render.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <optional>

#include "engine/core/error.h"
#include "engine/graph/compile.h"
#include "engine/graph/execute.h"
#include "engine/rays/rays.h"
#include "engine/scene/shading_tables.h"
#include "engine/scene/tables.h"
#include "passes/aov.h"
#include "passes/composite.h"
#include "passes/film.h"
#include "passes/frame.h"
#include "passes/frame_constants.h"
#include "shaders/shared/path.h"
#include "shaders/shared/sobol.h"

namespace halflight {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Paths of a band: enough to keep any device busy, few enough that a frame's buffers stay near half a gigabyte.
constexpr std::size_t kBandPaths = std::size_t{1} << 20;

void check(const RenderSettings& s) {
    const auto require = [](bool good, const char* what) {
        if (!good) throw Error("render settings", what);
    };
    require(s.width > 0 && s.height > 0, "width and height must be positive");
    require(s.width <= 65536 && s.height <= 65536, "width and height must be at most 65536");
    require(s.samples > 0, "samples must be positive");
    require(s.bounces >= 0, "bounces must not be negative");
    require(
        s.camera.orthographic ? s.camera.ortho_height > 0 : s.camera.vertical_fov > 0 && s.camera.vertical_fov < kPi,
        "the camera's field of view is not between 0 and 180 degrees, or its height is not positive");
    require(s.time_limit >= 0 && std::isfinite(s.time_limit), "the time limit must be zero or positive");
    for (const std::string& name : s.aovs) {
        const auto known = known_aovs();
        if (std::none_of(known.begin(), known.end(), [&](const AovInfo& a) { return a.name == name; })) {
            std::string names;
            for (const AovInfo& a : known) names += (names.empty() ? "" : ", ") + std::string(a.name);
            throw Error("render settings", "unknown AOV \"{}\"; there are: {}", name, names);
        }
    }
}

/// Bands of whole block rows, as few as the driver's limits on buffers and textures allow, and all alike: each costs as
/// much as the largest.
Band first_band(const RenderSettings& s, const SceneBuffers& scene, const gpu::Limits& limits) {
    // The widest records by path: the G-buffer's, and six doubles of sums.
    const std::size_t record = std::max(scene.surface_record_bytes(), 6 * sizeof(double));
    const std::size_t paths = std::min(kBandPaths, limits.storage_block_bytes / record);
    const std::size_t row_paths = (static_cast<std::size_t>(s.width) + 15) / 16 * 256;  // of a row of blocks
    if (s.width > limits.texture_size)
        throw Error("render settings", "{} pixels wide: the driver takes {}", s.width, limits.texture_size);
    const int most =
        std::min(static_cast<int>(std::max<std::size_t>(paths / row_paths, 1)) * 16, limits.texture_size / 16 * 16);
    const int bands = (s.height + most - 1) / most;
    const int rows = ((s.height + bands - 1) / bands + 15) / 16 * 16;
    return {{s.width, s.height}, 0, std::min(rows, s.height)};
}

/// Distance within which the camera sees everything there is; 1 for an empty scene.
double reach_of(const TraceTables& tables, const Camera& camera) {
    if (tables.bounds.empty()) return 1;
    const dvec3 eye = dvec3(camera.camera_to_world[3]) - tables.origin;
    const dvec3 far_corner =
        glm::max(glm::abs(dvec3(tables.bounds.lower) - eye), glm::abs(dvec3(tables.bounds.upper) - eye));
    return glm::length(far_corner);
}

}  // namespace

/// A graph, compiled for the band of a renderer.
struct CompiledFrame {
    graph::Graph graph;
    Frame frame;
    graph::BufferHandle aov;
    graph::BufferHandle debug;
    graph::CompiledGraph compiled;
};

struct Renderer::State {
    gpu::Context& context;
    const Scene& scene;
    RenderSettings settings;
    TraceTables trace_tables;
    gpu::ProgramCache programs;
    std::optional<rays::TraceScene> trace;
    std::optional<rays::RasterCulling> raster;
    std::optional<rays::Tracer> tracer;
    std::optional<SceneBuffers> buffers;
    std::optional<ViewKernel> view_kernel;
    gpu::Buffer frame_constants_buffer{"frame constants", sizeof(shared::Frame)};
    gpu::Buffer non_finite{"non-finite counts", shared::kCountedPasses * sizeof(std::uint32_t)};
    Band band;
    CompiledFrame sample;
    CompiledFrame data;                  // AOVs through the pixels' centres; empty unless asked for
    graph::Executor executor{programs};  // of samples: the sums are its history
    graph::Executor composer{programs};
    double prepare_seconds = 0;

    State(gpu::Context& c, const Scene& s, const ColorConfig& colors, RenderSettings r)
        : context(c), scene(s), settings(std::move(r)) {
        check(settings);
        validate(scene);
        const Clock::time_point start = Clock::now();
        trace_tables = build_trace_tables(scene, kFlattenLimit);
        buffers.emplace(trace_tables, build_shading_tables(scene, trace_tables));
        const rays::PackedScene packed = rays::pack_scene(trace_tables);
        trace.emplace(trace_tables, packed, buffers->defines());
        if (settings.culling == rays::Culling::raster)
            raster.emplace(packed, raster_settings());
        tracer.emplace(*trace, settings.culling, raster ? &*raster : nullptr);
        if (settings.measure) tracer->count();
        if (settings.want_view) view_kernel.emplace(colors.view(settings.view));
        prepare_seconds = seconds_since(start);

        band = first_band(settings, *buffers, context.limits());
        executor.measure(settings.measure);
        const FrameOptions options{settings.bounces, asked_for(settings, {"variance"}),
                                   asked_for(settings, {"albedo", "normal"})};
        sample.frame = add_frame(sample.graph, view(sample.graph), options, non_finite);
        sample.compiled = graph::compile(sample.graph);
        add_data();
        context.check("compiling the frame");
    }

    rays::RasterSettings raster_settings() const {
        rays::RasterSettings s;
        s.measure = settings.measure;
        return s;
    }

    void add_data() {
        const bool aov = asked_for(settings, {"position", "depth", "motion", "ids"});
        const DebugOptions debug{asked_for(settings, {"nodes"}), asked_for(settings, {"culling"})};
        if (!aov && !debug.nodes && !debug.culling) return;
        const SceneView seen = view(data.graph);
        const GBuffer gbuffer = add_gbuffer(data.graph, seen);
        if (aov) data.graph.output(data.aov = add_aov(data.graph, seen, gbuffer));
        if (debug.nodes || debug.culling)
            data.graph.output(data.debug = add_debug_aov(data.graph, seen, gbuffer, debug));
        data.compiled = graph::compile(data.graph);
    }

    SceneView view(graph::Graph& graph) {
        return {programs, *buffers, *trace,
                *tracer,  band,     graph.import_buffer("frame constants", frame_constants_buffer)};
    }

    /// Seeds of different frames and of different user seeds share nothing.
    std::uint32_t frame_seed() const { return shared::hash_combine(shared::hash_u32(settings.seed), settings.frame); }

    void set_frame(const Band& where, const vec2& jitter, int index) {
        const shared::Frame constants = frame_constants(
            settings.camera, settings.previous_camera.value_or(settings.camera), trace_tables.origin,
            reach_of(trace_tables, settings.camera), {where, jitter, static_cast<std::uint32_t>(index), frame_seed()});
        frame_constants_buffer.write(0, sizeof(constants), &constants);
    }

    /// The point of every pixel that sample `index` looks through: one sequence for the whole frame, as rasterizing
    /// demands.
    vec2 jitter(int index) const {
        const shared::Sampler s = shared::make_sampler(~0u, ~0u, static_cast<std::uint32_t>(index), frame_seed());
        return shared::sample_2d(s, 0);
    }

    /// Adds samples to a band until there are enough, time is up, or the callback says stop. Returns how many.
    int render_band(const Band& where, double time_limit, const std::function<bool(int)>& after_sample) {
        const Clock::time_point start = Clock::now();
        executor.history().invalidate("new band");
        for (int done = 1;; ++done) {
            set_frame(where, jitter(done - 1), done - 1);
            executor.run(sample.compiled);
            glFinish();
            context.check("rendering");
            const bool go_on = after_sample(done);
            if (!go_on || done == settings.samples) return done;
            // Another sample like those so far would end late.
            if (time_limit > 0 && seconds_since(start) * (done + 1) / done > time_limit) return done;
        }
    }

    void develop(const Band& where, int samples, Film& film) {
        const auto sums = [&](graph::BufferHandle h) { return h ? executor.read<double>(h) : std::vector<double>{}; };
        const Accumulated& a = sample.frame.sums;
        film.add_sums(where, samples,
                      {sums(a.emission), sums(a.direct), sums(a.indirect), sums(a.squares), sums(a.features)});

        graph::Graph graph;
        const auto import = [&](graph::BufferHandle h) {
            return h ? graph.import_buffer("sums", executor.buffer(h)) : graph::BufferHandle{};
        };
        Accumulated imported;
        imported.emission = import(a.emission);
        imported.direct = import(a.direct);
        imported.indirect = import(a.indirect);
        const Composite composite = add_composite(graph, band, imported, samples, !scene.environment.black(),
                                                  view_kernel ? &*view_kernel : nullptr);
        graph.output(composite.beauty);
        if (composite.view) graph.output(composite.view);
        composer.run(graph::compile(graph));
        film.add_pictures(where, composer.texture(composite.beauty).read_float(),
                          composite.view ? composer.texture(composite.view).read_float() : std::vector<float>{});

        if (data.aov || data.debug) {
            set_frame(where, vec2(0.5f), 0);
            executor.run(data.compiled);
        }
        if (data.aov) film.add_data(where, executor.read<shared::AovRecord>(data.aov));
        if (data.debug) film.add_debug(where, executor.read<shared::DebugRecord>(data.debug));
    }
};

Renderer::Renderer(gpu::Context& context, const Scene& scene, const ColorConfig& colors, RenderSettings settings)
    : state_(std::make_unique<State>(context, scene, colors, std::move(settings))) {}
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer::~Renderer() = default;

RenderResult Renderer::render(const ProgressCallback& progress) {
    State& s = *state_;
    const Clock::time_point start = Clock::now();
    const double compiled_before = s.programs.seconds();
    s.executor.reset_times();
    s.non_finite.clear();
    const int bands = (s.settings.height + s.band.rows - 1) / s.band.rows;

    RenderResult result;
    RenderStats& stats = result.stats;
    stats.samples = s.settings.samples;
    Film film(s.settings, s.trace_tables);
    for (int b = 0; b < bands; ++b) {
        Band where = s.band;
        where.y = b * s.band.rows;
        const double time_left = s.settings.time_limit > 0
                                     ? std::max((s.settings.time_limit - seconds_since(start)) / (bands - b), 1e-9)
                                     : 0.0;
        const int done = s.render_band(where, time_left, [&](int samples) {
            if (!progress) return true;
            const std::int64_t of_all = std::int64_t{b} * s.settings.samples + samples;
            const bool go_on = progress({static_cast<int>(of_all / bands), s.settings.samples, seconds_since(start)});
            stats.interrupted = stats.interrupted || !go_on;
            return go_on;
        });
        s.develop(where, done, film);
        stats.samples = std::min(stats.samples, done);
        stats.paths += std::uint64_t(std::min(where.rows, s.settings.height - where.y)) *
                       std::uint64_t(s.settings.width) * std::uint64_t(done);
    }
    s.context.check("rendering");
    film.take(result);

    stats.compile_seconds = s.programs.seconds() - compiled_before;
    stats.render_seconds = seconds_since(start) - stats.compile_seconds;
    stats.prepare_seconds = s.prepare_seconds;
    const std::size_t pictures =
        (s.view_kernel ? 2 : 1) * sizeof(vec4) * std::size_t(s.band.image.x) * std::size_t(s.band.rows);
    stats.gpu_bytes = s.buffers->bytes() + s.trace->statistics().bytes + s.executor.history().bytes() + pictures +
                      std::max(s.sample.compiled.slot_bytes, s.data.compiled.slot_bytes);
    stats.left_out = s.sample.frame.left_out;
    for (const graph::PassTime& t : s.executor.times()) stats.passes.push_back({t.name, t.count, t.seconds});
    stats.batches = s.tracer->statistics();
    stats.raster = s.tracer->raster_statistics();
    const auto counts = s.non_finite.read<std::uint32_t>();
    const char* names[shared::kCountedPasses] = {"gbuffer", "shadow", "diffuse and glossy", "continuation"};
    for (std::size_t i = 0; i < shared::kCountedPasses; ++i) stats.non_finite.push_back({names[i], counts[i]});
    return result;
}

std::string Renderer::graph_dot() const {
    return graph::to_dot(state_->sample.compiled);
}

}  // namespace halflight
