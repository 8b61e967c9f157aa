#include "renderer/render.h"

#include <algorithm>
#include <cassert>
#include <numeric>

#include "engine/core/error.h"
#include "engine/settings/data_window.h"
#include "renderer/focus.h"
#include "renderer/render_state.h"
#include "renderer/sampling.h"
#include "renderer/settings_check.h"

namespace halflight {
namespace {

std::optional<ViewKernel> view_kernel(const ColorConfig& colors, const RenderSettings& settings) {
    if (!settings.want_view) return std::nullopt;
    return std::optional<ViewKernel>(colors.view(settings.view));
}

}  // namespace

Renderer::Renderer(PreparedScene& scene, const ColorConfig& colors, RenderSettings settings, rays::BatchServer* server,
                   std::shared_ptr<RadianceCache> cache) {
    check_settings(settings);
    state_ = std::make_unique<State>(nullptr, scene, colors, view_kernel(colors, settings), settings, server,
                                     std::move(cache));
}

Renderer::Renderer(gpu::Context& context, const Scene& scene, const ColorConfig& colors,
                   const RenderSettings& settings) {
    check_settings(settings);
    const bool raster = row_of(settings.culling).needs_cull_tree;
    auto own =
        std::make_unique<PreparedScene>(context, scene, PrepareOptions{raster, settings.kept, settings.estimator});
    PreparedScene& prepared = *own;
    state_ = std::make_unique<State>(std::move(own), prepared, colors, view_kernel(colors, settings), settings, nullptr,
                                     nullptr);
}

Renderer::Renderer(Renderer&&) noexcept = default;
Renderer::~Renderer() = default;

Renderer::State& Renderer::state() const {
    if (!state_) throw Error("renderer", "its update has failed, and it cannot be used any more");
    return *state_;
}

void Renderer::update(const Scene& scene) {
    [[maybe_unused]] const State& now = state();  // state() throws after a failed update
    assert(now.own);
    std::unique_ptr<State> last = std::move(state_);  // destroyed if this function throws
    if (last->scene.update(scene)) {
        state_ = std::move(last);
        return follow_scene();
    }
    if (last->cache) last->cache->clear();
    PreparedScene& prepared = last->scene;
    state_ = std::make_unique<State>(std::move(last->own), prepared, last->colors, std::move(last->view_kernel),
                                     last->asked, nullptr, last->given_cache);
}

void Renderer::follow_scene() {
    State& s = state();
    if (s.cache) s.cache->clear();
    s.servers.follow();
    s.hierarchies_reported = false;
}

void Renderer::forget(std::string reason) {
    state().executor.history().invalidate(std::move(reason));
    state().servers.tracer->invalidate();
    if (state().cache) state().cache->clear();
}

RenderResult Renderer::render(const ProgressCallback& progress) {
    return render(state().settings, progress);
}

void Renderer::follow_camera(const Camera& camera) {
    if (state().options.lens == camera.lens.blurs() && state().options.optics == camera.optics.traced()) return;
    std::unique_ptr<State> last = std::move(state_);  // destroyed if this function throws
    RenderSettings asked = last->asked;
    asked.camera = camera;
    PreparedScene& prepared = last->scene;
    state_ = std::make_unique<State>(std::move(last->own), prepared, last->colors, std::move(last->view_kernel), asked,
                                     last->servers.given, last->given_cache);
}

RenderResult Renderer::render(const FrameSettings& frame, const ProgressCallback& progress) {
    return render(frame, PictureInputs{}, progress);
}

RenderResult Renderer::render(const FrameSettings& wanted, const PictureInputs& inputs,
                              const ProgressCallback& progress) {
    state().scene.check_usable();
    // Checks what the caller asked for. What the last camera resolved, such as primary visibility, holds for it only.
    check_settings(state().asked, wanted,
                   {.shutter = bool(inputs.pose), .checkpoint = inputs.checkpoint != nullptr});
    const Stopwatch watch;
    follow_camera(wanted.camera);
    State& s = state();
    s.inputs = inputs;
    struct Release {
        PictureInputs& inputs;
        ~Release() { inputs = {}; }
    } const release{s.inputs};
    s.pose.at.reset();
    FrameSettings frame = wanted;
    if (Focus& focus = frame.camera.lens.focus; s.options.lens && focus.kind == Focus::Kind::point)
        focus = {.kind = Focus::Kind::distance, .distance = find_focus(s.scene, s.colors, s.asked, frame.camera)};
    const double compiled_before = s.scene.programs().seconds();
    s.executor.reset_times();
    s.servers.reset_statistics();
    if (s.scene.buffers().tiles()) s.scene.buffers().tiles()->reset_statistics();
    s.in_flight->reset();
    if (s.preview) s.preview->begin(inputs.history);
    if (s.denoiser)
        s.denoiser->begin(inputs.noisy, frame.camera, s.bands.first, data_window(s.asked).first - s.bands.first.origin);
    if (s.cache) s.cache->begin_picture(s.scene.programs());

    RenderResult result;
    RenderStats& stats = result.stats;
    std::vector<int> done(std::size_t(s.bands.count));  // number of finished samples by band
    /// Moves the picture of the finished samples from a film to a result.
    const auto take = [&](Film& film, RenderResult& to) {
        s.apply_to_picture(frame, done, film);
        s.scene.context().check("rendering");
        s.finish(to, film, frame, done, watch, compiled_before);
    };
    const SamplePlan plan = plan_of(s.settings, frame, s.cache != nullptr, inputs.checkpoint != nullptr);
    const bool in_order = frame.shutter_times.value_or(0) == 0;  // else, later shutter times may be missing
    const bool whole_sums = plan.sequences == 1 && plan.parts == 1 && plan.least == 0;
    const bool sums_are_there = in_order && whole_sums && (plan.together || s.bands.count == 1);
    /// Calls the callback. all: expected number of samples of all bands.
    const auto go_on = [&](std::int64_t all) {
        if (!progress) return true;
        if (stats.interrupted) return false;  // a callback that has stopped the picture is not asked again
        const auto sum = std::accumulate(done.begin(), done.end(), std::int64_t{0});
        RenderProgress report{static_cast<int>(sum / s.bands.count), static_cast<int>(all / s.bands.count),
                              watch.seconds()};
        if (sums_are_there && std::ranges::count(done, done[0]) == s.bands.count) {
            report.picture = [&](const std::vector<std::string>& aovs) {
                RenderResult so_far;
                Film own(s.settings, s.scene.tables(), s.pages(), aovs);
                for (int b = 0; b < s.bands.count; ++b) s.develop(frame, b, done[std::size_t(b)], own);
                take(own, so_far);
                return so_far;
            };
        }
        stats.interrupted = !progress(report);
        return !stats.interrupted;
    };

    std::optional<Film> film;  // its layers take memory only once samples are there
    State::Sampling sampling(s, frame, plan, watch, done, go_on);
    sampling.run([&](int band) {
        const std::vector<std::string> none;
        if (!film) film.emplace(s.settings, s.scene.tables(), s.pages(), frame.stays_noisy ? none : s.settings.aovs);
        s.develop(frame, band, done[std::size_t(band)], *film);
    });
    assert(film);  // the first band has a sample, whatever stops the picture
    take(*film, result);
    s.hierarchies_reported = true;
    if (frame.error && !stats.interrupted) {
        const ErrorEstimate estimate = sampling.error().estimate();
        stats.error = {*frame.error, estimate, estimate.bound <= frame.error->error};
    }
    return result;
}

void Renderer::denoise(NoisyFrame& frame, std::span<const NearFrame> near, RenderResult& result) {
    State& s = state();
    s.denoiser->denoise(frame, near, result);
    s.scene.context().check("denoising");
}

std::string Renderer::graph_dot() const {
    return graph::to_dot(state().compiled(0).graphs.sample.compiled);
}

}  // namespace halflight
