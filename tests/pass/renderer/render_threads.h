// Runs the viewer's render thread and records its pictures, for tests.
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>

#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"
#include "tests/support/test_device.h"
#include "tools/view/render_thread.h"

namespace halflight::view {

/// Owns a render thread and all pictures that it has published.
class RecordingThread {
  public:
    explicit RecordingThread(double budget = 1e6)
        : thread_(ColorConfig::load(),
                  {.context = {.device = test::test_device()}, .budget = budget, .changed = [this] {
                       const std::lock_guard lock(mutex_);
                       changed_ = true;
                       const auto newest = thread_.picture();
                       if (newest != newest_) published_.push_back(newest);
                       newest_ = newest;
                       wake_.notify_all();
                   }}) {}

    RenderThread& operator*() { return thread_; }
    RenderThread* operator->() { return &thread_; }

    /// Takes pictures one by one until done() holds; returns false if it does not hold within minutes.
    template <class F>
    bool until(const F& done) {
        const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(4);
        for (;;) {
            if (done()) return true;
            std::unique_lock lock(mutex_);
            if (!wake_.wait_until(lock, end, [&] { return changed_ || !published_.empty(); })) return false;
            changed_ = false;
            if (published_.empty()) continue;
            pictures.push_back(published_.front());
            published_.pop_front();
        }
    }
    /// Waits until the whole picture of a request has this number of samples.
    bool until_samples(std::uint64_t request, int samples) {
        return until([&] {
            return !pictures.empty() && pictures.back()->request == request && pictures.back()->divisor == 1 &&
                   pictures.back()->result.stats.samples == samples;
        });
    }

    /// Shows a request until its whole picture has this number of samples; returns the picture.
    std::shared_ptr<const Picture> take(const Request& request, int samples) {
        thread_.limit(samples);
        EXPECT_TRUE(until_samples(thread_.show(request), samples)) << thread_.status().error;
        return pictures.back();
    }

    std::vector<std::shared_ptr<const Picture>> pictures;  // all pictures taken, in order

  private:
    std::mutex mutex_;
    std::condition_variable wake_;
    bool changed_ = false;
    std::deque<std::shared_ptr<const Picture>> published_;  // pictures not yet taken
    std::shared_ptr<const Picture> newest_;
    RenderThread thread_;
};

class RenderThreadTest : public GpuTest {
  protected:
    Request request() const {
        Request r;
        r.reference = r.scene = scene;
        r.camera = scene->cameras[0];
        r.size = {60, 45};
        r.bounces = 3;
        return r;
    }
    /// Returns the picture that `halflight render` makes for the request, with this number of samples.
    RenderResult expected(const Request& r, int samples) {
        Scene edited = *r.scene;
        apply(r.edits, edited);
        RenderSettings s;
        s.width = r.size.x, s.height = r.size.y;
        s.camera = r.camera;
        s.bounces = r.bounces;
        s.samples = samples;
        s.aovs = r.aovs;
        s.culling = r.culling;
        return test::render(context, edited, s);
    }
    /// Expects a thread's picture to be that of `halflight render`, bit for bit; returns it.
    std::shared_ptr<const Picture> expect_rendered(RecordingThread& thread, const Request& r, int samples) {
        const std::shared_ptr<const Picture> picture = thread.take(r, samples);
        test::expect_includes(picture->result, expected(r, samples));
        return picture;
    }

    std::shared_ptr<const Scene> scene = std::make_shared<const Scene>(test::shiny_cornell());
};

}  // namespace halflight::view
