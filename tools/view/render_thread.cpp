#include "tools/view/render_thread.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "tools/view/clock.h"
#include "tools/view/workplace.h"

namespace halflight::view {
namespace {

constexpr int kMostSamples = 1 << 24;
constexpr auto kSettle = std::chrono::milliseconds(100);  // without another request: then the camera stands still
constexpr double kLookEvery = 0.1;                        // seconds from picture to picture of a whole one
constexpr double kLookShare = 0.2;                        // of the time may go into making them

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
    wanted_ = std::move(request);
    since_ = now();
    wake_.notify_all();
    return ++number_;
}

void RenderThread::limit(int samples) {
    const std::lock_guard lock(mutex_);
    limit_ = samples;
    wake_.notify_all();
}

std::shared_ptr<const Picture> RenderThread::picture() const {
    const std::lock_guard lock(mutex_);
    return picture_;
}

RenderThread::Status RenderThread::status() const {
    const std::lock_guard lock(mutex_);
    return status_;
}

void RenderThread::publish(Picture picture) {
    auto made = std::make_shared<const Picture>(std::move(picture));
    {
        const std::lock_guard lock(mutex_);
        picture_ = std::move(made);
        status_.error.clear();
        status_.failed = 0;
    }
    options_.changed();
}

void RenderThread::say(std::string activity) {
    {
        const std::lock_guard lock(mutex_);
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

void RenderThread::go_on(std::uint64_t number, bool first_is_there) const {
    const std::lock_guard lock(mutex_);
    if (stop_ || (first_is_there && number != number_)) throw Stale();
}

void RenderThread::settle(std::uint64_t number) {
    std::unique_lock lock(mutex_);
    if (wake_.wait_for(lock, kSettle, [&] { return stop_ || number != number_; })) throw Stale();
}

void RenderThread::hold(std::uint64_t number, int samples, int limit) {
    if (samples < limit) return;
    say("");
    std::unique_lock lock(mutex_);
    wake_.wait(lock, [&] { return stop_ || number != number_ || samples < limit_; });
    if (stop_ || number != number_) throw Stale();
    lock.unlock();
    say("rendering");
}

void RenderThread::run(ColorConfig colors) {
    try {
        gpu::Context context = gpu::Context::create(options_.context);
        {
            const std::lock_guard lock(mutex_);
            status_.device = context.renderer();
        }
        Workplace place(context, std::move(colors), options_.budget);
        for (std::uint64_t done = 0;;) {
            Request request;
            double since = 0;
            {
                std::unique_lock lock(mutex_);
                wake_.wait(lock, [&] { return stop_ || number_ != done; });
                if (stop_) return;
                request = wanted_, done = number_, since = since_;
            }
            try {
                serve(place, request, done, since);
            } catch (const Stale&) {
            } catch (const std::exception& error) {
                fail(done, error.what(), false);
            }
        }
    } catch (const std::exception& error) {
        fail(0, error.what(), true);
    }
}

void RenderThread::serve(Workplace& place, const Request& request, std::uint64_t number, double since) {
    if (place.needs_scene(request)) say("preparing the scene");
    place.prepare(request);
    say("rendering");
    const int divisor = place.resolution().divisor(request.size);
    if (divisor > 1) {
        FrameSettings frame;
        frame.camera = request.camera;
        frame.samples = 1;
        const bool is_new = place.is_new(divisor);
        Renderer& renderer = place.renderer(divisor);
        const double start = now();
        RenderResult result = renderer.render(frame, [&](const RenderProgress&) {
            go_on(number, false);
            return true;
        });
        const double seconds = now() - start;
        if (!is_new) place.resolution().took(divided(request.size, divisor), seconds);
        publish({number, divisor, now() - since, request.camera, request.aovs, std::move(result)});
        settle(number);
    }
    refine(place, request, number, since, divisor > 1);
}

void RenderThread::refine(Workplace& place, const Request& request, std::uint64_t number, double since, bool shown) {
    FrameSettings frame;
    frame.camera = request.camera;
    frame.samples = kMostSamples;
    const bool is_new = place.is_new(1);
    Renderer& renderer = place.renderer(1);
    double looked = -1e9;  // when the last picture was published
    double cost = 0;       // seconds that it took to make
    renderer.render(frame, [&](const RenderProgress& progress) {
        go_on(number, shown);
        if (!progress.picture) return true;
        const int samples = progress.samples_done;
        int limit = 0;
        {
            const std::lock_guard lock(mutex_);
            limit = limit_;
        }
        const double before = now();
        if (samples == 1 || samples >= limit || before - looked > std::max(kLookEvery, cost / kLookShare)) {
            RenderResult result = progress.picture();
            cost = now() - before;
            if (samples == 1 && !is_new) place.resolution().took(request.size, progress.seconds + cost);
            looked = now();
            publish({number, 1, looked - since, request.camera, request.aovs, std::move(result)});
            shown = true;
        }
        hold(number, samples, limit);
        return true;
    });
}

}  // namespace halflight::view
