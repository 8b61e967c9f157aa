#include "renderer/render.h"

#include <algorithm>
#include <cassert>
#include <numeric>

#include "engine/core/error.h"
#include "engine/settings/data_window.h"

#include "renderer/focus.h"
#include "renderer/render_state.h"
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
                                     last->asked, nullptr, nullptr);
}

void Renderer::follow_scene() {
    State& s = state();
    if (s.cache) s.cache->clear();
    if (s.server) s.server->follow(s.served());
    if (s.offered_server) s.offered_server->follow(s.served());
    s.hierarchies_reported = false;
}

void Renderer::forget(std::string reason) {
    state().executor.history().invalidate(std::move(reason));
    state().tracer->invalidate();
    if (state().cache) state().cache->clear();
}

RenderResult Renderer::render(const ProgressCallback& progress) {
    return render(state().settings, progress);
}

void Renderer::follow_camera(const Camera& camera) {
    if (state().options.lens == camera.lens.blurs() && state().options.optics == camera.optics.traced()) return;
    // Throws for a method that cannot show the picture, as long as the state is whole.
    resolved(state().asked.primary, 0, ivec2(1), shown_by_tracing(camera.optics, camera.lens.blurs(), false));
    std::unique_ptr<State> last = std::move(state_);  // destroyed if this function throws
    RenderSettings asked = last->asked;
    asked.camera = camera;
    PreparedScene& prepared = last->scene;
    state_ = std::make_unique<State>(std::move(last->own), prepared, last->colors, std::move(last->view_kernel), asked,
                                     last->given_server, last->given_cache);
}

RenderResult Renderer::render(const FrameSettings& frame, const ProgressCallback& progress) {
    return render(frame, PictureInputs{}, progress);
}

RenderResult Renderer::render(const FrameSettings& wanted, const PictureInputs& inputs,
                              const ProgressCallback& progress) {
    state().scene.check_usable();
    check_settings(state().settings, wanted,
                   {.shutter = bool(inputs.pose),
                    .checkpoint = inputs.checkpoint != nullptr,
                    .catchers = state().scene.tables().catchers});
    const Stopwatch watch;
    follow_camera(wanted.camera);
    State& s = state();
    s.inputs = inputs;
    s.posed_at.reset();
    FrameSettings frame = wanted;
    if (Focus& focus = frame.camera.lens.focus; s.options.lens && focus.kind == Focus::Kind::point)
        focus = {.kind = Focus::Kind::distance, .distance = find_focus(s.scene, s.colors, s.asked, frame.camera)};
    const double compiled_before = s.scene.programs().seconds();
    s.executor.reset_times();
    s.tracer->reset_statistics();
    if (s.page_rows) s.page_rows->reset_statistics();
    if (s.scene.buffers().tiles()) s.scene.buffers().tiles()->reset_statistics();
    s.in_flight->reset();
    if (s.preview) s.preview->begin(inputs.history);
    if (s.denoiser) s.denoiser->begin(inputs.noisy, frame.camera, s.band, data_window(s.asked).first - s.band.origin);
    if (s.cache) s.cache->begin_picture(s.scene.programs());

    RenderResult result;
    RenderStats& stats = result.stats;
    PictureError error;
    std::vector<int> done(std::size_t(s.bands));  // number of finished samples by band
    const bool in_turns = s.settings.in_turns && !frame.error && !s.settings.adaptive;
    const bool in_order = frame.shutter_times.value_or(0) == 0;  // else, later shutter times may be missing
    const bool sums_are_there = in_order && !frame.error && !s.settings.adaptive && (in_turns || s.bands == 1);
    /// Calls the callback. all: expected number of samples of all bands.
    const auto go_on = [&](std::int64_t all) {
        if (!progress) return true;
        if (stats.interrupted) return false;  // a callback that has stopped the picture is not asked again
        const auto sum = std::accumulate(done.begin(), done.end(), std::int64_t{0});
        RenderProgress report{static_cast<int>(sum / s.bands), static_cast<int>(all / s.bands), watch.seconds()};
        if (sums_are_there && std::ranges::count(done, done[0]) == s.bands) {
            report.picture = [&](const std::vector<std::string>& aovs) {
                RenderResult so_far;
                Film own(s.settings, s.scene.tables(), s.pages(), aovs);
                s.develop(frame, done, own);
                s.apply_to_picture(frame, done, own);
                s.finish(so_far, own, frame, done, watch, compiled_before);
                return so_far;
            };
        }
        stats.interrupted = !progress(report);
        return !stats.interrupted;
    };
    // Pictures in turns come from the callback. Their layers take memory only once all samples are there.
    if (in_turns)
        s.render_in_turns(frame, frame.time_limit, done, [&] { return go_on(std::int64_t{frame.samples} * s.bands); });
    Film film(s.settings, s.scene.tables(), s.pages(),
              frame.stays_noisy ? std::vector<std::string>() : s.settings.aovs);
    if (in_turns) {
        s.develop(frame, done, film);
    } else if (frame.error && s.settings.adaptive) {
        s.render_to_error_adaptively(frame, done, go_on, error);
        s.develop(frame, done, film);
    } else {
        std::vector<std::uint32_t> plan;  // empty: a picture that ends in the pilot gets one sample
        if (s.settings.adaptive && s.inputs.checkpoint) plan = s.saved_plan(frame);
        if (s.settings.adaptive && plan.empty())
            plan = s.plan_samples(frame, [&] {
                stats.interrupted = progress && !progress({0, frame.samples, watch.seconds(), {}});
                return !stats.interrupted;
            });
        if (s.settings.adaptive && plan.empty()) s.inputs.checkpoint = nullptr;  // there is no plan to go on with
        std::int64_t samples_before = 0;
        for (int b = 0; b < s.bands && (b == 0 || !stats.interrupted); ++b) {
            CompiledBand& with = s.compiled(b);
            with.mattes->clear();
            with.first_samples = 0;
            with.samples.clear();
            const Band where = s.band_at(b);
            const double spent = watch.seconds() + (s.inputs.checkpoint ? s.inputs.checkpoint->earlier_seconds() : 0);
            const double time_left =
                frame.time_limit > 0 ? std::max((frame.time_limit - spent) / (s.bands - b), 1e-9) : 0.0;
            int& of_band = done[std::size_t(b)];
            std::optional<SavedBand> saved;
            PlanState state;
            if (s.inputs.checkpoint) saved = s.restore(frame, where, with, state);
            if (saved) of_band = saved->samples;
            const auto after_sample = [&](int samples, int total) {
                of_band = samples;
                return go_on(samples_before + std::int64_t{total} * (s.bands - b));
            };
            if (!inputs.merged.empty())
                of_band = s.merge_parts(frame, where, with);
            else if (frame.parts > 1 && frame.part == 0)
                of_band = s.render_parts(frame, where, with, after_sample);
            else if (!plan.empty())
                of_band = s.render_band_adaptively(frame, where, with, plan, after_sample, state);
            else if (frame.error)
                of_band = s.render_band_to_error(frame, where, with, time_left, after_sample, error, state);
            else if (!saved || !saved->complete)
                of_band = s.render_band(frame, where, with, of_band, time_left, after_sample);
            samples_before += of_band;
            s.develop(frame, where, with, of_band, film);
        }
    }
    s.apply_to_picture(frame, done, film);
    s.scene.context().check("rendering");
    s.finish(result, film, frame, done, watch, compiled_before);
    s.hierarchies_reported = true;
    if (frame.error && !stats.interrupted) {
        const ErrorEstimate estimate = error.estimate();
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
