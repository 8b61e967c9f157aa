#include "tools/view/render_thread.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <tuple>
#include <utility>

#include "engine/core/interruption.h"
#include "engine/core/steps.h"
#include "engine/settings/layers.h"
#include "tools/view/clock.h"
#include "tools/view/layer_view.h"
#include "tools/view/renderer_cache.h"
#include "tools/view/resolution.h"
#include "tools/view/standing_picture.h"

namespace halflight::view {
namespace {

constexpr auto kSettle = std::chrono::milliseconds(100);  // time without a request after which the camera is at rest
constexpr double kLookEvery = 0.1;                        // minimum time between whole pictures, seconds
constexpr double kLookShare = 0.2;                        // maximum share of time for making pictures of samples
constexpr auto kWatch = std::chrono::milliseconds(500);   // time between checks of the shader files

constexpr std::string_view kMotion = "motion";

/// Returns `aovs` and those of `more` that are missing in it. Mattes are left out.
std::vector<std::string> with(std::vector<std::string> aovs, const std::vector<std::string>& more) {
    for (const std::string& name : more)
        if (!find_aov(name)->is_matte() && std::ranges::find(aovs, name) == aovs.end()) aovs.push_back(name);
    return aovs;
}

/// Decides when pictures are made of the samples so far, and which have all layers.
class Looks {
  public:
    bool wanted = false;  // a picture must be made at once

    bool due(int samples, int limit) const {
        return wanted || (published_ < samples && (published_ == 0 || samples >= limit ||
                                                   now() - looked_ > std::max(kLookEvery, cost_ / kLookShare)));
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
    int published_ = 0;      // samples of the last published picture
    int complete_ = 0;       // samples of the last complete picture
    double looked_ = -1e9;   // time of the last publication, seconds
    double cost_ = 0;        // time to make a picture from the samples, seconds
};

}  // namespace

bool same(const Camera& a, const Camera& b) {
    const auto members = [](const Camera& c) {
        return std::tie(c.name, c.camera_to_world, c.orthographic, c.vertical_fov, c.ortho_height, c.aspect,
                        c.near_plane, c.far_plane, c.lens);
    };
    return members(a) == members(b);
}

bool Request::operator==(const Request& o) const {
    const auto members = [](const Request& r) {
        return std::tie(r.reference, r.scene, r.edits, r.frame, r.size, r.region, r.bounces, r.aovs, r.modes, r.culling,
                        r.measure);
    };
    return same(camera, o.camera) && members(*this) == members(o);
}

bool serves(const Request& made, const Request& wanted) {
    Request other = wanted;
    other.aovs = made.aovs, other.region = made.region;
    return other == made;
}

std::vector<std::string> sampled_aovs() {
    std::vector<std::string> aovs;
    for (const AovInfo& aov : known_aovs())
        if (!aov.is_matte()) aovs.emplace_back(aov.name);
    return aovs;
}

std::vector<std::string> complete_aovs() {
    std::vector<std::string> aovs;
    for (const AovInfo& aov : known_aovs())
        if (!aov.is_matte() && !aov.debug() && aov.name != kMotion) aovs.emplace_back(aov.name);
    return aovs;
}

bool wants_motion(const Request& request) {
    return std::ranges::find(request.aovs, kMotion) != request.aovs.end();
}

std::vector<std::string> mattes_of(const std::vector<std::string>& aovs) {
    std::vector<std::string> mattes;
    for (const std::string& name : aovs)
        if (const AovInfo* aov = find_aov(name); aov && aov->is_matte()) mattes.push_back(name);
    return mattes;
}

RenderThread::RenderThread(ColorConfig colors, Options options)
    : options_(std::move(options)), thread_([this, colors = std::move(colors)] { run(colors); }) {}

RenderThread::~RenderThread() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    wake_.notify_all();
    thread_.join();
}

std::uint64_t RenderThread::show(Request request) {
    const std::lock_guard lock(mutex_);
    ++number_;
    if (number_ == 1 || !serves(wanted_, request)) view_ = number_;
    wanted_ = std::move(request);
    since_ = now();
    wake_.notify_all();
    return number_;
}

void RenderThread::limit(int samples) {
    const std::lock_guard lock(mutex_);
    limit_ = samples;
    wake_.notify_all();
}

void RenderThread::perform(std::string activity, std::function<void()> work, bool interrupts) {
    const std::lock_guard lock(mutex_);
    work_.push_back({std::move(activity), std::move(work), interrupts});
    wake_.notify_all();
}

std::shared_ptr<const Picture> RenderThread::picture() const {
    const std::lock_guard lock(mutex_);
    return picture_;
}

std::shared_ptr<const Picture> RenderThread::complete_picture() const {
    const std::lock_guard lock(mutex_);
    return complete_;
}

std::uint64_t RenderThread::view() const {
    const std::lock_guard lock(mutex_);
    return view_;
}

RenderThread::Status RenderThread::status() const {
    const std::lock_guard lock(mutex_);
    return status_;
}

void RenderThread::publish(Picture picture) {
    if (picture.divisor == 1)
        picture.relmse = picture.region ? estimated_relmse(picture.aovs, picture.result, picture.samples(),
                                                           picture.region->window)
                                        : estimated_relmse(picture.aovs, picture.result);
    auto made = std::make_shared<const Picture>(std::move(picture));
    {
        const std::lock_guard lock(mutex_);
        const auto has = [&](const std::string& aov) {
            return std::ranges::find(made->aovs, aov) != made->aovs.end();
        };
        if (std::ranges::all_of(complete_aovs(), has)) complete_ = made;
        picture_ = std::move(made);
        status_.error.clear();
        status_.failed = 0;
    }
    options_.changed();
}

void RenderThread::say(std::string activity) {
    {
        const std::lock_guard lock(mutex_);
        if (status_.activity == activity) return;
        status_.activity = std::move(activity);
    }
    options_.changed();
}

void RenderThread::fail(std::uint64_t number, std::string error, bool for_good) {
    {
        const std::lock_guard lock(mutex_);
        status_.error = std::move(error);
        status_.failed = number;
        status_.ended = for_good;
        status_.activity.clear();
    }
    options_.changed();
}

bool RenderThread::follow(const Request& made, Job& job) {
    const std::lock_guard lock(mutex_);
    if (job.number == number_ || !serves(made, wanted_)) return false;
    job.request = wanted_, job.number = number_;
    return true;
}

bool RenderThread::superseded(const Job& job) const {
    const std::lock_guard lock(mutex_);
    return job.number != number_;
}

int RenderThread::limit() const {
    const std::lock_guard lock(mutex_);
    return limit_;
}

void RenderThread::go_on(const Job& job, bool first_is_there, bool samples) const {
    const std::lock_guard lock(mutex_);
    const bool work = samples ? std::ranges::any_of(work_, &Work::interrupts) : !work_.empty();
    if (stop_ || (first_is_there && (job.view != view_ || work))) throw Stale();
}

void RenderThread::work(const Work& work) {
    const Interruptible never([] {});
    say(work.activity);
    work.work();
    say("");
}

void RenderThread::do_work_between_samples() {
    for (;;) {
        Work next;
        {
            const std::lock_guard lock(mutex_);
            if (stop_ || work_.empty() || std::ranges::any_of(work_, &Work::interrupts)) return;
            next = std::move(work_.front());
            work_.pop_front();
        }
        work(next);
    }
}

void RenderThread::show_step(const char* what) {
    const WorkPart part = current_part();
    say(part.number > 0 ? fmt::format("{}, pass {} of {}", what, part.number, part.count) : std::string(what));
}

void RenderThread::settle(std::uint64_t number) {
    std::unique_lock lock(mutex_);
    if (wake_.wait_for(lock, kSettle, [&] { return stop_ || !work_.empty() || number != number_; })) throw Stale();
}

template <class F>
void RenderThread::wait(RendererCache& renderers, std::unique_lock<std::mutex>& lock, const F& done) {
    if (!shaders_.watching()) return wake_.wait(lock, done);
    while (!wake_.wait_for(lock, kWatch, done)) {
        lock.unlock();
        take_shaders(renderers);
        lock.lock();
    }
}

void RenderThread::hold(RendererCache& renderers, std::uint64_t number, int samples) {
    say("");
    {
        std::unique_lock lock(mutex_);
        wait(renderers, lock, [&] { return stop_ || !work_.empty() || number != number_ || samples < limit_; });
    }
    say("rendering");
}

void RenderThread::take_shaders(RendererCache& renderers) {
    if (!shaders_.watching() || now() - shaders_looked_at_ < std::chrono::duration<double>(kWatch).count()) return;
    shaders_looked_at_ = now();
    if (!shaders_.changed()) return;
    std::string error;
    bool taken = false;
    try {
        taken = renderers.reload_shaders();
    } catch (const std::exception& e) {
        error = e.what();
    }
    {
        const std::lock_guard lock(mutex_);
        taken |= error.empty() && status_.failed != 0;  // the failed request may succeed now
        status_.shader_error = error;
        if (error.empty()) ++status_.reloads;
    }
    options_.changed();
    if (taken) throw Stale();
}

std::optional<std::variant<RenderThread::Job, RenderThread::Work>> RenderThread::next(RendererCache& renderers,
                                                                                      std::uint64_t done, bool again) {
    std::unique_lock lock(mutex_);
    try {
        wait(renderers, lock, [&] { return stop_ || !work_.empty() || again || number_ != done; });
    } catch (const Stale&) {
        lock.lock();
    }
    if (stop_) return std::nullopt;
    if (work_.empty()) return Job{wanted_, number_, view_, since_};
    Work work = std::move(work_.front());
    work_.pop_front();
    return work;
}

void RenderThread::run(ColorConfig colors) {
    try {
        gpu::Context context = gpu::Context::create(options_.context);
        {
            const std::lock_guard lock(mutex_);
            status_.device = context.renderer();
        }
        const StepWatch steps([this](const char* what, int) { show_step(what); }, [this] { say("rendering"); });
        RendererCache renderers(context, std::move(colors), options_.budget);
        std::uint64_t done = 0;  // number of the last job
        bool again = false;      // the last job must be repeated
        while (const auto todo = next(renderers, done, again)) {
            if (const auto* waiting = std::get_if<Work>(&*todo)) {
                work(*waiting);
                continue;
            }
            const Job& job = std::get<Job>(*todo);
            done = job.number;
            again = false;
            if (done == 0) continue;  // shaders have changed before the first request
            try {
                serve(renderers, job);
            } catch (const Stale&) {
                again = true;
            } catch (const std::exception& error) {
                fail(done, error.what(), false);
            }
        }
    } catch (const std::exception& error) {
        fail(0, error.what(), true);
    }
}

void RenderThread::serve(RendererCache& renderers, const Job& job) {
    const Request& request = job.request;
    if (renderers.needs_scene(request)) say("preparing the scene");
    renderers.prepare(request);
    say("rendering");
    const int divisor = renderers.resolution().divisor(request.size);
    if (divisor > 1) {
        publish(coarse(renderers, job, divisor));
        settle(job.number);
    }
    refine(renderers, job, divisor > 1);
}

void RenderThread::add_mattes(RendererCache& renderers, const Job& job, int divisor, int samples, Picture& picture) {
    const std::vector<std::string> mattes = mattes_of(job.request.aovs);
    if (mattes.empty()) return;
    RenderResult made = renderers.mattes(divisor, samples, mattes);
    std::ranges::move(made.aovs, std::back_inserter(picture.result.aovs));
    picture.result.attributes.merge(made.attributes);
    picture.aovs.insert(picture.aovs.end(), mattes.begin(), mattes.end());
}

Picture RenderThread::coarse(RendererCache& renderers, const Job& job, int divisor) {
    FrameSettings frame;
    renderers.fill_frame_settings(frame);
    frame.samples = 1;
    const bool is_new = renderers.is_new(divisor);
    Renderer& renderer = renderers.renderer(divisor);
    const double start = now();
    struct Done {};  // ends render() before it makes a picture with fewer AOVs
    Picture picture{.request = job.number,
                    .view = job.view,
                    .divisor = divisor,
                    .camera = job.request.camera,
                    .aovs = with(complete_aovs(), job.request.aovs)};
    const Interruptible stops([&] { go_on(job, false, false); });
    try {
        renderer.render(frame, [&](const RenderProgress& progress) {
            go_on(job, false, false);
            if (!progress.picture) return true;
            picture.result = progress.picture(picture.aovs);
            throw Done();
        });
    } catch (const Done&) {
    }
    add_mattes(renderers, job, divisor, 1, picture);
    if (!is_new) renderers.resolution().record(divided(job.request.size, divisor), now() - start);
    picture.seconds = now() - job.since;
    return picture;
}

void RenderThread::refine(RendererCache& renderers, Job job, bool shown) {
    const Request made = job.request;
    FrameSettings frame;
    renderers.fill_frame_settings(frame);
    frame.samples = kMostSamples;
    const bool is_new = renderers.is_new(1);
    Renderer& renderer = renderers.renderer(1);
    Looks looks;
    const Interruptible stops([&] { go_on(job, shown, !looks.none()); });
    StandingPicture standing;  // regions whose pixels have more samples than the whole picture
    renderer.render(frame, [&](const RenderProgress& progress) {
        for (;;) {
            if (!looks.none()) do_work_between_samples();
            looks.wanted |= follow(made, job);
            go_on(job, shown, !looks.none());
            if (wants_motion(job.request) && !wants_motion(made) && renderers.pose_is_new()) throw Stale();
            take_shaders(renderers);
            say("rendering");
            if (!progress.picture) return true;
            const int samples = progress.samples_done;
            if (job.request.region ? looks.none() : looks.due(samples, limit())) {
                const double before = now();
                Picture picture{.request = job.number,
                                .view = job.view,
                                .divisor = 1,
                                .camera = made.camera,
                                .aovs = looks.aovs(samples, job.request)};
                const bool first = samples == 1 && looks.none() && !is_new;
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
    frame.history = nullptr;
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
        renderers.region_renderer(window).render(frame, [&](const RenderProgress& progress) {
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
