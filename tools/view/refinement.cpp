// The pictures of a request: coarse ones, the whole one, and its refinement, also of a region.
#include <algorithm>
#include <iterator>
#include <utility>

#include "engine/core/interruption.h"
#include "engine/settings/layers.h"
#include "tools/view/clock.h"
#include "tools/view/render_thread.h"
#include "tools/view/renderer_cache.h"
#include "tools/view/resolution.h"
#include "tools/view/standing_picture.h"

namespace halflight::view {
namespace {

constexpr double kLookEvery = 0.1;    // minimum time between whole pictures, seconds
constexpr double kLookShare = 0.2;    // maximum share of time for making pictures of samples
constexpr double kEarlyShare = 0.35;  // this share as long as each picture has twice the samples of the last one

/// Returns `aovs` and those of `more` that are missing in it. Mattes are left out.
std::vector<std::string> with(std::vector<std::string> aovs, const std::vector<std::string>& more) {
    for (const std::string& name : more)
        if (!find_aov(name)->is_matte() && std::ranges::find(aovs, name) == aovs.end()) aovs.push_back(name);
    return aovs;
}

/// Decides when pictures are made of the samples so far, and which have all layers.
class Looks {
  public:
    /// denoises: each picture is denoised, which takes as long as several samples, so pictures are made only when the
    /// samples have doubled. shown: there is a coarse picture already.
    explicit Looks(bool denoises = false, bool shown = false) : denoises_(denoises), shown_(shown) {}
    bool wanted = false;  // a picture must be made at once

    bool due(int samples, int limit) const {
        constexpr int kFirstDenoised = 4;  // samples
        const bool doubled = samples >= 2 * published_;
        const double share = doubled ? kEarlyShare : kLookShare;
        if (denoises_ && !wanted && samples < limit && (!doubled || (shown_ && samples < kFirstDenoised))) return false;
        return wanted ||
               (published_ < samples && (published_ == 0 || samples >= limit ||
                                         now() - looked_ > std::max(kLookEvery, cost_ * (1 - share) / share)));
    }
    bool none() const { return published_ == 0; }
    bool newer(int samples) const { return published_ < samples; }
    /// Returns whether the next picture is a complete one.
    bool all(int samples) const { return samples >= 2 * complete_; }
    /// Returns the AOVs of the next picture.
    std::vector<std::string> aovs(int samples, const Request& request) const {
        return with(all(samples) ? complete_aovs() : std::vector<std::string>{"variance"}, request.aovs);
    }
    /// Records a picture that was begun at `before`, seconds. Returns the time that it took, seconds.
    double made(int samples, double before) {
        if (all(samples)) complete_ = samples;
        published_ = samples;
        wanted = false;
        looked_ = now();
        return cost_ = looked_ - before;
    }

  private:
    bool denoises_, shown_;
    int published_ = 0;     // samples of the last published picture
    int complete_ = 0;      // samples of the last complete picture
    double looked_ = -1e9;  // time of the last publication, seconds
    double cost_ = 0;       // time to make a picture from the samples, seconds
};

}  // namespace

void RenderThread::add_mattes(RendererCache& renderers, const Job& job, int divisor, int samples, Picture& picture) {
    const std::vector<std::string> mattes = mattes_of(job.request.aovs);
    if (mattes.empty()) return;
    RenderResult made = renderers.mattes(divisor, samples, mattes);
    std::ranges::move(made.aovs, std::back_inserter(picture.result.aovs));
    picture.result.attributes.merge(made.attributes);
    picture.aovs.insert(picture.aovs.end(), mattes.begin(), mattes.end());
}

Picture RenderThread::coarse(RendererCache& renderers, const Job& job, int divisor, bool first) {
    FrameSettings frame;
    renderers.fill_frame_settings(frame);
    frame.samples = 1;
    // The time for filtering the first picture is better spent on its resolution.
    const Preview& modes = job.request.modes.preview;
    const bool filters = modes.filter || job.request.modes.denoise;
    const RendererCache::Kind kind{divisor, filters && (!first || modes.temporal)};
    const bool is_new = renderers.is_new(kind);
    Renderer& renderer = renderers.renderer(kind);
    const double start = now();
    compiled_ = false;
    struct Done {};  // ends render() before it makes a picture with fewer AOVs
    Picture picture{.request = job.number,
                    .view = job.view,
                    .divisor = divisor,
                    .camera = job.request.camera,
                    .aovs = with(complete_aovs(), job.request.aovs)};
    const Interruptible stops([&] { go_on(job, !first, false); });
    try {
        renderer.render(frame, renderers.inputs(), [&](const RenderProgress& progress) {
            go_on(job, !first, false);
            if (!progress.picture) return true;
            picture.result = progress.picture(picture.aovs);
            throw Done();
        });
    } catch (const Done&) {
    }
    add_mattes(renderers, job, divisor, 1, picture);
    if (first && !is_new && !compiled_)
        renderers.resolution().record(divided(job.request.size, divisor), now() - start);
    picture.seconds = now() - job.since;
    return picture;
}

void RenderThread::refine(RendererCache& renderers, Job job, bool shown) {
    const Request made = job.request;
    FrameSettings frame;
    renderers.fill_frame_settings(frame);
    frame.samples = kMostSamples;
    const RendererCache::Kind kind{1, made.modes.preview.filter, made.modes.denoise};
    const bool is_new = renderers.is_new(kind);
    Renderer& renderer = renderers.renderer(kind);
    Looks looks(made.modes.denoise, shown);
    const Interruptible stops([&] { go_on(job, shown, !looks.none()); });
    compiled_ = false;
    StandingPicture standing;  // regions whose pixels have more samples than the whole picture
    renderer.render(frame, renderers.inputs(), [&](const RenderProgress& progress) {
        for (;;) {
            if (!looks.none()) do_work_between_samples();
            looks.wanted |= follow(made, job);
            go_on(job, shown, !looks.none());
            if (wants_motion(job.request) && !wants_motion(made) && renderers.pose_is_new()) throw Stale();
            take_shaders(renderers);
            say("rendering");
            if (!progress.picture) return true;
            const int samples = progress.samples_done;
            count(job.request.region ? 0 : samples);
            if (job.request.region ? looks.none() : looks.due(samples, limit())) {
                const double before = now();
                Picture picture{.request = job.number,
                                .view = job.view,
                                .divisor = 1,
                                .camera = made.camera,
                                .aovs = looks.aovs(samples, job.request)};
                const bool first = samples == 1 && looks.none() && !is_new && !compiled_;
                picture.result = progress.picture(picture.aovs);
                standing.lay_over(picture.result);
                add_mattes(renderers, job, 1, samples, picture);
                const double cost = looks.made(samples, before);
                if (first) renderers.resolution().record(made.size, progress.seconds + cost);
                picture.seconds = now() - job.since;
                publish(std::move(picture));
                shown = true;
            }
            if (job.request.region) {
                const std::vector<std::string> aovs = with(complete_aovs(), job.request.aovs);
                if (standing.whole_samples() < samples || !standing.has(aovs)) standing.take(progress.picture(aovs));
                refine_region(renderers, job, standing);
                continue;
            }
            if (samples < limit()) return true;
            hold(renderers, job.number, samples);
        }
    });
}

void RenderThread::refine_region(RendererCache& renderers, const Job& job, StandingPicture& standing) {
    const PixelWindow window = *job.request.region;
    const int before = standing.least(window);
    FrameSettings frame;
    renderers.fill_frame_settings(frame);
    PictureInputs inputs = renderers.inputs();
    inputs.history = nullptr;
    frame.first_sample = standing.most(window);  // no pixel has samples from this one on
    frame.samples = kMostSamples - frame.first_sample;
    Looks looks;
    const auto show = [&](RenderResult result, int samples) {
        Picture picture{.request = job.number,
                        .view = job.view,
                        .divisor = 1,
                        .camera = job.request.camera,
                        .aovs = {},
                        .result = std::move(result),
                        .region = Picture::RegionSamples{window, samples}};
        for (const ExrLayer& layer : picture.result.aovs) picture.aovs.push_back(layer.name);
        add_mattes(renderers, job, 1, samples, picture);
        picture.seconds = now() - job.since;
        publish(std::move(picture));
    };
    show(standing.picture(), before);
    while (before >= limit()) {
        hold(renderers, job.number, before);
        do_work_between_samples();
        go_on(job, true, true);
        if (superseded(job)) return;
    }
    struct Done {};  // ends render() before it makes a picture of its own
    try {
        renderers.region_renderer(window).render(frame, inputs, [&](const RenderProgress& progress) {
            for (;;) {
                do_work_between_samples();
                go_on(job, true, true);
                take_shaders(renderers);
                if (!progress.picture) return true;
                const int added = progress.samples_done, samples = before + added;
                if (superseded(job)) {
                    standing.add(progress.picture(with(complete_aovs(), job.request.aovs)), window);
                    throw Done();
                }
                if (looks.due(added, limit() - before)) {
                    const double begun = now();
                    show(standing.with(progress.picture(looks.aovs(added, job.request)), window), samples);
                    looks.made(added, begun);
                }
                if (samples < limit()) return true;
                hold(renderers, job.number, samples);
            }
        });
    } catch (const Done&) {
    }
}

}  // namespace halflight::view
