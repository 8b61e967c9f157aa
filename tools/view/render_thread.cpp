#include "tools/view/render_thread.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "engine/core/interruption.h"
#include "engine/core/steps.h"
#include "tools/view/clock.h"
#include "tools/view/layer_view.h"
#include "tools/view/renderer_cache.h"
#include "tools/view/resolution.h"

namespace halflight::view {
namespace {

constexpr auto kSettle = std::chrono::milliseconds(100);  // time without a request after which the camera is at rest
constexpr auto kWatch = std::chrono::milliseconds(500);   // time between checks of the shader files

}  // namespace

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
        picture.relmse = picture.region
                             ? estimated_relmse(picture.aovs, picture.result, picture.samples(), picture.region->window)
                             : estimated_relmse(picture.aovs, picture.result);
    auto made = std::make_shared<const Picture>(std::move(picture));
    {
        const std::lock_guard lock(mutex_);
        const auto has = [&](const std::string& aov) { return std::ranges::find(made->aovs, aov) != made->aovs.end(); };
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

void RenderThread::count(int samples) {
    constexpr double kEvery = 0.25;  // seconds between two changes that the window shows
    {
        const std::lock_guard lock(mutex_);
        status_.samples = samples;
    }
    if (samples == 0 || now() - counted_ < kEvery) return;
    counted_ = now();
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
    compiled_ = true;
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
        taken |= error.empty() && status_.failed != 0;  // the failed request may succeed with other shaders
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
    count(0);
    if (renderers.needs_scene(request)) say("preparing the scene");
    renderers.prepare(request);
    say("rendering");
    // Work between the pictures ends them. Then they go on from the one that is shown.
    const auto shown = picture();
    const bool goes_on = shown && shown->view == job.view && shown->divisor > 1;
    int divisor = goes_on ? shown->divisor : renderers.resolution().divisor(request.size);
    double seconds = options_.budget;  // time of the last picture
    const auto show = [&](bool first) {
        const double begin = now();
        publish(coarse(renderers, job, divisor, first));
        seconds = now() - begin;
    };
    const bool is_coarse = divisor > 1;
    if (is_coarse && !goes_on) {
        show(true);
        settle(job.number);
    }
    while (!request.modes.preview.temporal && worth_finer(seconds, divisor, options_.budget)) {
        divisor /= 2;
        show(false);
    }
    refine(renderers, job, is_coarse);
}

}  // namespace halflight::view
