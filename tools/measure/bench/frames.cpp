#include "tools/measure/bench/frames.h"

#include <algorithm>
#include <array>
#include <bit>
#include <glm/gtc/matrix_transform.hpp>
#include <memory>
#include <optional>
#include <random>

#include "engine/core/error.h"
#include "engine/core/metrics.h"
#include "engine/graph/compile.h"
#include "engine/graph/execute.h"
#include "engine/rays/raster.h"
#include "engine/tables/shading_tables.h"
#include "renderer/frame.h"
#include "renderer/frame_constants.h"
#include "shaders/shared/path_state.h"
#include "shaders/shared/pixel_order.h"
#include "tools/measure/bench/graph_run.h"
#include "tools/measure/bench/naive_tracer.h"

namespace halflight::bench {
namespace {

constexpr double kWorst = 0.001;  // share of values that the trimmed error omits

struct Variant {
    const char* name;
    rays::Culling culling;
    bool forgets = false;
    bool naive = false;
    /// Returns whether sums must equal those of the plain tracer and cover all samples.
    bool exact() const { return !forgets && !naive; }
};
constexpr std::array kVariants{
    Variant{"naive", rays::Culling::off, false, true}, Variant{"off", rays::Culling::off},
    Variant{"compute", rays::Culling::compute},        Variant{"fresh", rays::Culling::compute, true},
    Variant{"auto", rays::Culling::automatic},         Variant{"raster", rays::Culling::raster}};
constexpr const Variant& kPlain = kVariants[1];

/// Inputs that all variants share.
struct Subject {
    Subject(const gpu::Context& context, const Scene& scene, const TraceTables& t, const rays::PackedScene& p,
            const FrameOrder& order)
        : tables(t),
          packed(p),
          buffers(t, build_shading_tables(scene, t)),
          trace(t, p, buffers.defines()),
          storage_block_bytes(context.limits().storage_block_bytes),
          bounces(order.bounces),
          band{order.size, 0, order.size.y} {
        if (band.paths() * widest_record_bytes(buffers) > storage_block_bytes)
            throw Error("--size", "frames of {}x{} need more than one band of this driver", order.size.x, order.size.y);
    }

    const TraceTables& tables;
    const rays::PackedScene& packed;
    SceneBuffers buffers;
    rays::TraceScene trace;
    std::size_t storage_block_bytes;
    int bounces;
    Band band;
    gpu::ProgramCache programs;
};

/// A frame graph, its state, and the times of its runs.
class Rendering {
  public:
    Rendering(Subject& subject, const Variant& variant) : subject_(subject), variant_(variant) {
        if (variant.culling == rays::Culling::raster) server_ = std::make_unique<rays::RasterCulling>(subject.packed);
        if (variant.naive) server_ = std::make_unique<NaiveTracer>(subject.tables, subject.storage_block_bytes);
        if (server_) {
            tracer_.emplace(subject.trace, *server_);
        } else {
            tracer_.emplace(subject.trace, variant.culling);
        }
        graph::Graph graph;
        const SceneView view{subject.buffers, subject.trace, *tracer_, subject.band,
                             graph.import_buffer("frame constants", constants_)};
        frame_ = add_frame(graph, view, {.bounces = subject.bounces}, {bad_values_});
        compiled_ = graph::compile(graph);
        watch_batches();
    }

    const Variant& variant() const { return variant_; }

    void forget() {
        executor_.history().invalidate("bench");
        tracer_->invalidate();
        series_.frames.clear();
        for (auto& [batch, seconds] : series_.batches) seconds.clear();
        tracer_->reset_statistics();
    }

    void render(const FrameSettings& frame, int sample) {
        if (variant_.forgets) executor_.history().invalidate("bench");
        const SampleView at =
            sample_view(frame, subject_.band, static_cast<std::uint32_t>(sample), SamplePoints::sobol);
        const shared::Frame constants = frame_constants(frame, subject_.tables, at);
        constants_.write(0, sizeof(constants), &constants);
        for (auto& [batch, seconds] : series_.batches) seconds.emplace_back();
        series_.frames.push_back(time_of([&] { executor_.run(compiled_); }));
    }

    /// Returns the times since forget().
    Series series() const {
        Series series = series_;
        series.variant = variant_.name;
        series.chosen = tracer_->statistics();
        return series;
    }

    /// Returns mean radiance, three values per pixel.
    std::vector<double> picture() {
        const auto read = [&](graph::BufferHandle h) { return h ? executor_.read<double>(h) : std::vector<double>{}; };
        const std::vector<double> emission = read(frame_.sums.emission);
        const std::vector<std::vector<double>> light{read(frame_.sums.direct), read(frame_.sums.indirect)};
        const auto samples = static_cast<double>(series_.frames.size());
        std::vector<double> picture;
        for (std::uint32_t path = 0; path < subject_.band.paths(); ++path) {
            const uvec2 pixel = shared::pixel_of_path(path, subject_.band.tiles());
            if (glm::any(glm::greaterThanEqual(ivec2(pixel), subject_.band.image))) continue;
            for (std::size_t c = 0; c < 3; ++c) {
                double sum = emission[path * 4 + c];
                for (const std::vector<double>& l : light)
                    if (!l.empty()) sum += l[path * 6 + c] + l[path * 6 + 3 + c];
                picture.push_back(sum / samples);
            }
        }
        return picture;
    }

  private:
    /// Measures the passes of ray batches. Passes of one batch are consecutive.
    void watch_batches() {
        std::map<std::string, int> seen;
        std::string last;
        for (graph::PlannedPass& pass : compiled_.passes) {
            const std::size_t end = pass.name.find(" rays: ");
            const std::string kind = end == std::string::npos ? "" : pass.name.substr(0, end);
            if (!kind.empty()) {
                if (kind != last) ++seen[kind];
                std::vector<Seconds>& seconds = series_.batches[seen[kind] == 1 ? kind : "later " + kind];
                pass.execute = [&seconds, step = pass.execute](graph::Resources& r) {
                    const Seconds taken = time_of([&] { step(r); });
                    seconds.back().wall += taken.wall;
                    seconds.back().cpu += taken.cpu;
                };
            }
            last = kind;
        }
    }

    Subject& subject_;
    Variant variant_;
    std::unique_ptr<rays::BatchServer> server_;
    std::optional<rays::Tracer> tracer_;
    gpu::Buffer constants_{"frame constants", sizeof(shared::Frame)};
    gpu::Buffer bad_values_{"bad values", kBadValueCounts * sizeof(std::uint32_t)};
    Frame frame_;
    graph::CompiledGraph compiled_;
    graph::Executor executor_{subject_.programs};
    Series series_;
};

using Renderings = std::vector<std::unique_ptr<Rendering>>;

/// Renders one frame of each variant, in random order.
template <class Render>
void take_turns(const Renderings& renderings, std::mt19937& random, const Render& render) {
    std::vector<Rendering*> order;
    for (const auto& rendering : renderings) order.push_back(rendering.get());
    std::ranges::shuffle(order, random);
    for (Rendering* rendering : order) render(*rendering);
}

std::vector<Series> all_series(const Renderings& renderings) {
    std::vector<Series> all;
    for (const auto& rendering : renderings) all.push_back(rendering->series());
    return all;
}

std::vector<double> reference_picture(Subject& subject, FrameSettings frame, const std::function<void()>& between) {
    frame.seed = 1;  // differs from the seed of the frames
    Rendering rendering(subject, kPlain);
    for (int i = 0; i < frame.samples; ++i) {
        between();
        rendering.render(frame, i);
    }
    return rendering.picture();
}

std::size_t count_different(const std::vector<double>& a, const std::vector<double>& b) {
    const std::size_t pixels = a.size() / 3;
    std::size_t count = 0;
    for (std::size_t p = 0; p < pixels; ++p) {
        bool same = true;
        for (std::size_t i = 3 * p; i < 3 * p + 3; ++i)
            same = same && std::bit_cast<std::uint64_t>(a[i]) == std::bit_cast<std::uint64_t>(b[i]);
        count += same ? 0 : 1;
    }
    return count;
}

/// Returns the camera after `view` steps to and fro on an arc. Its centre has the depth of the scene's middle.
Camera moved(const Camera& camera, const TraceTables& tables, int view) {
    constexpr int kTurn = 12;              // steps from one end of the arc to the other
    constexpr double kStep = kPi / 90;     // angle of a step, radians
    constexpr double kNearest = 1.0 / 16;  // least distance, share of the scene's diagonal
    const int phase = (view + kTurn / 2) % (2 * kTurn);
    const double angle = kStep * ((phase < kTurn ? phase : 2 * kTurn - phase) - kTurn / 2);

    const dvec3 eye(camera.camera_to_world[3]);
    const dvec3 forward = -dvec3(camera.camera_to_world[2]);
    const dvec3 centre = tables.origin + 0.5 * (dvec3(tables.bounds.lower) + dvec3(tables.bounds.upper));
    const double nearest = kNearest * glm::length(dvec3(tables.bounds.extent()));
    const dvec3 target = eye + forward * std::max(glm::dot(centre - eye, forward), nearest);
    Camera result = camera;
    result.camera_to_world = glm::translate(dmat4(1), target) * glm::rotate(dmat4(1), angle, dvec3(0, 1, 0)) *
                             glm::translate(dmat4(1), -target) * camera.camera_to_world;
    return result;
}

}  // namespace

const std::vector<std::string>& variant_names() {
    static const std::vector<std::string> names = names_of(kVariants);
    return names;
}

FrameResult measure_frames(gpu::Context& context, const Scene& scene, const TraceTables& tables,
                           const rays::PackedScene& packed, const Camera& camera, const FrameOrder& order,
                           const std::function<void()>& between) {
    Subject subject(context, scene, tables, packed, order);
    const FrameSettings still{{.camera = camera}, order.reference};
    const std::vector<double> reference =
        order.reference > 0 ? reference_picture(subject, still, between) : std::vector<double>{};
    Renderings renderings;
    for (const Variant& variant : kVariants) {
        if (std::ranges::find(order.variants, variant.name) == order.variants.end()) continue;
        renderings.push_back(std::make_unique<Rendering>(subject, variant));
        renderings.back()->render(still, 0);
    }
    std::mt19937 random(1);
    FrameResult result;

    for (const auto& rendering : renderings) rendering->forget();
    for (int i = 0; i < order.samples; ++i) {
        between();
        take_turns(renderings, random, [&](Rendering& r) { r.render(still, i); });
        const auto done = static_cast<std::uint32_t>(i + 1);
        if (!reference.empty() && (std::has_single_bit(done) || i + 1 == order.samples)) {
            const auto whole = std::ranges::find_if(renderings, [](const auto& r) { return r->variant().exact(); });
            if (whole != renderings.end()) {
                const std::vector<double> picture = (*whole)->picture();
                result.errors.push_back(
                    {i + 1, relative_mse(picture, reference), relative_mse(picture, reference, kWorst)});
            }
        }
    }
    result.still = all_series(renderings);
    std::vector<double> first;
    for (const auto& rendering : renderings) {
        if (!rendering->variant().exact()) continue;
        const std::vector<double> picture = rendering->picture();
        if (first.empty()) first = picture;
        result.different += count_different(picture, first);
    }

    for (const auto& rendering : renderings) rendering->forget();
    FrameSettings moving = still;
    for (int i = 0; i < order.views; ++i) {
        between();
        moving.previous_camera = moving.camera;
        moving.camera = moved(camera, tables, i);
        moving.frame = static_cast<std::uint32_t>(i);
        take_turns(renderings, random, [&](Rendering& r) { r.render(moving, 0); });
    }
    if (order.views > 0) result.moving = all_series(renderings);
    context.check("frames");
    return result;
}

}  // namespace halflight::bench
