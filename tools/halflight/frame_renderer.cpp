#include "tools/halflight/frame_renderer.h"

#include <algorithm>
#include <utility>

#include "passes/light/radiance_cache.h"
#include "renderer/shutter.h"
#include "tools/halflight/render_parts.h"

namespace halflight {

int shutter_count(const RenderArguments& a, int samples) {
    constexpr int kUsualTimes = 8;
    if (a.shutter == 0) return 1;
    const bool variance = std::ranges::find(a.settings.aovs, "variance") != a.settings.aovs.end();
    return a.shutter_times.value_or(std::clamp(variance ? samples / 2 : samples, 1, kUsualTimes));
}

std::string shutter_text(const RenderArguments& a, int samples) {
    if (a.shutter == 0) return "";
    return fmt::format("open for {:g} of a frame, {} times", a.shutter, shutter_count(a, samples));
}

FrameRenderer::FrameRenderer(const RenderArguments& a, AnimatedScene& scene, gpu::Context& context,
                             const ColorConfig& config, RenderSettings settings)
    : a_(a), scene_(scene), context_(context), config_(config), settings_(std::move(settings)) {
    if (settings_.preview.cache) settings_.radiance_cache = std::make_shared<RadianceCache>();
    if (std::ranges::any_of(scene.scene().meshes, &Mesh::deforms)) {
        deformer_.emplace(context);
        scene.deform_by(&*deformer_);
    }
}

FrameRenderer::~FrameRenderer() {
    if (deformer_) scene_.deform_by(nullptr);
}

template <class F>
auto FrameRenderer::guarded(F f) {
    try {
        return f();
    } catch (...) {
        renderer_.reset();  // may be in the middle of anything
        history_.forget();
        throw;
    }
}

RenderResult FrameRenderer::render(std::uint32_t frame, const ProgressCallback& progress) {
    load_seconds_ = 0;
    if (deformer_) deformer_->take_statistics();  // of a frame that could not be made
    set_frame(settings_, scene_, frame);
    // Surfaces are known where they were one frame ago, and nowhere else.
    if (scene_.surfaces_move() && last_frame_ != frame - 1) history_.forget();
    last_frame_.reset();  // until this one is made
    settings_.history = &history_;
    RenderResult result = a_.shutter > 0 ? blurred(frame, progress) : still(frame, settings_, progress);
    last_frame_ = frame;
    if (deformer_) {
        deformed_ = deformer_->take_statistics();
        result.stats.gpu_bytes += deformer_->bytes();
    }
    return result;
}

RenderResult FrameRenderer::still(std::uint32_t frame, const FrameSettings& settings,
                                  const ProgressCallback& progress) {
    const double seconds = scene_.frame_rate().seconds(frame);
    const bool motion = settings_.preview.temporal || std::ranges::find(a_.settings.aovs, "motion") != a_.settings.aovs.end();
    if (!scene_.surfaces_move() || !motion) return picture(seconds, settings, progress);
    Stopwatch watch;
    Scene before = scene_.posed(scene_.frame_rate().seconds(static_cast<double>(frame) - 1));
    load_seconds_ += watch.lap();
    pose(seconds, settings);
    const PreviousSurfaces surfaces(scene_.scene(), std::move(before));
    FrameSettings moving = settings;
    moving.previous_surfaces = &surfaces;
    return picture(seconds, moving, progress);
}

void FrameRenderer::pose(double seconds, const FrameSettings& frame) {
    Stopwatch watch;
    const bool is_new = !renderer_;
    if (is_new) {
        // Always first of all as it is at 0 s, the reference pose: what is made of others depends on it.
        scene_.pose(0);
        load_seconds_ += watch.lap();
        RenderSettings settings = settings_;
        static_cast<FrameSettings&>(settings) = frame;
        settings.camera = scene_.chosen_camera().camera;  // a pilot's
        settings.previous_surfaces = nullptr;             // of this picture alone
        settings.history = nullptr;
        settings.want_view = settings.want_view && a_.shutter == 0;  // of the mean
        renderer_.emplace(context_, scene_.scene(), config_, settings);
        reference_seconds_ = watch.lap();
    }
    if (!scene_.pose(seconds)) {
        if (is_new) reference_seconds_ = 0;  // which is the pose itself
        return;
    }
    load_seconds_ += watch.lap();
    guarded([&] { renderer_->update(scene_.scene()); });
}

RenderResult FrameRenderer::picture(double seconds, const FrameSettings& frame, const ProgressCallback& progress) {
    pose(seconds, frame);
    if (settings_.radiance_cache) settings_.radiance_cache->clear();  // a frame does not depend on those before it
    RenderResult result = guarded([&] { return renderer_->render(frame, progress); });
    result.stats.prepare_seconds += std::exchange(reference_seconds_, 0);
    return result;
}

RenderResult FrameRenderer::blurred(std::uint32_t frame, const ProgressCallback& progress) {
    const FrameSettings own = settings_;
    const Stopwatch watch;
    ShutterMean mean(settings_.aovs, own.samples);
    for (const ShutterTime& time : shutter_times(own.samples, shutter_count(a_, own.samples), own.seed, frame)) {
        const double seconds = scene_.frame_rate().seconds(frame + a_.shutter * (time.at - 0.5));
        FrameSettings part = own;
        part.camera = scene_.camera(seconds).camera;
        part.first_sample = time.first_sample;
        part.samples = time.samples;
        part.of_samples = own.samples;
        const auto of_all = [&](RenderProgress p) {
            p.samples_done += time.first_sample;
            p.samples_total = own.samples;
            p.seconds = watch.seconds();
            return progress(p);
        };
        const bool prepared = renderer_ && !scene_.surfaces_move();
        RenderResult result = picture(seconds, part, of_all);
        if (result.stats.interrupted) return result;
        if (prepared) result.stats.prepare_seconds = 0;  // for an earlier time
        mean.add(result);
    }
    RenderResult own_time;
    if (mean.wants_still()) {
        FrameSettings one = own;
        one.samples = 1;
        own_time = still(frame, one, {});
    }
    RenderResult result = mean.take(std::move(own_time));
    if (settings_.want_view) result.view = config_.view(settings_.view).apply(result.beauty);
    return result;
}

}  // namespace halflight
