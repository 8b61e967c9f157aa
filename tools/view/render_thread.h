// Renders the last request on a thread and a context of its own. A coarse picture comes first, within a time budget.
// Finer ones follow, each in about four times the time of the one before, and then the whole picture, which is refined
// until another request comes. Without preview modes, it equals the unbiased mean that `halflight render` makes of as
// many samples, bit for bit. If HALFLIGHT_SHADERS names a folder, changed shaders in it are reloaded.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "engine/gpu/shader_source.h"
#include "tools/view/request.h"

namespace halflight::view {

class RendererCache;
class StandingPicture;

class RenderThread {
  public:
    struct Options {
        gpu::ContextOptions context;
        double budget = 0.1;                    // time until the first picture of a request, seconds
        std::function<void()> changed = [] {};  // called from the thread after each change of picture() or status()
    };
    RenderThread(ColorConfig colors, Options options);
    RenderThread(const RenderThread&) = delete;
    RenderThread& operator=(const RenderThread&) = delete;
    /// Waits for the current work of the device. This is a sample, the preparation of a scene, the compilation of
    /// shaders, a picture made of samples, or work passed to perform().
    ~RenderThread();

    /// Replaces the current request and returns the number of the new one, from 1; never waits. If the first picture of
    /// the earlier request is being rendered, that picture is still published. Samples that serve() the new request
    /// are kept.
    std::uint64_t show(Request request);
    /// Sets the number of samples of a whole picture or a region; a higher limit continues a finished one. The picture
    /// at exactly this number is always published, unless more samples are done or begun: then the picture at which
    /// rendering stops is published. Pictures of fewer samples are published at intervals.
    void limit(int samples);
    /// Queues work for the thread; never waits. The thread renders nothing while it does the work, which must not
    /// throw. `activity` is the status text meanwhile. If it interrupts, it begins at once, and the samples so far are
    /// lost. Otherwise it waits for the end of the current sample, and they are kept, because the work may fail.
    void perform(std::string activity, std::function<void()> work, bool interrupts = true);

    std::shared_ptr<const Picture> picture() const;  ///< Returns the newest picture; null before the first one.
    /// Returns the newest picture with complete_aovs(); null before the first one.
    std::shared_ptr<const Picture> complete_picture() const;
    std::uint64_t view() const;  ///< Returns Picture::view of the current request's pictures.
    struct Status {
        std::string device;         // name of the context's renderer; empty until the context exists
        std::string activity;       // description of the current work; empty: idle
        int samples = 0;            // samples of the whole picture that is being made; 0: none, or those of a region
        std::string error;          // reason why request `failed` has no picture
        std::uint64_t failed = 0;   // number of the failed request; 0: none failed since the last picture
        std::string shader_error;   // reason why changed shaders are not used; empty: all are used
        std::uint64_t reloads = 0;  // number of successful reloads of changed shaders
        bool ended = false;         // the thread has ended for good: there is no device
    };
    Status status() const;

  private:
    struct Stale {};  // thrown when the current picture is no longer wanted or must be started again
    struct Job {
        Request request;
        std::uint64_t number = 0;
        std::uint64_t view = 0;  // Picture::view
        double since = 0;        // time of the request, seconds
    };
    struct Work {
        std::string activity;
        std::function<void()> work;
        bool interrupts = true;
    };

    void run(ColorConfig colors);
    void serve(RendererCache& renderers, const Job& job);
    /// Returns a picture of one sample and reduced size. `first` marks the first picture of the job. It is completed
    /// even if a newer request waits, so that a moving camera always shows pictures.
    Picture coarse(RendererCache& renderers, const Job& job, int divisor, bool first);
    void refine(RendererCache& renderers, Job job, bool shown);  ///< shown: the job's coarse picture is published
    /// Adds samples to the region of the job until there is another request. The picture stands outside of the region.
    void refine_region(RendererCache& renderers, const Job& job, StandingPicture& standing);
    void publish(Picture picture);
    void say(std::string activity);
    void count(int samples);  // Sets Status::samples.
    void fail(std::uint64_t number, std::string error, bool for_good);
    /// Waits for the next job or work and returns it; none: the thread has to end.
    std::optional<std::variant<Job, Work>> next(RendererCache& renderers, std::uint64_t done, bool again);
    /// Switches the job to the current request if the samples made serve it; returns whether it did.
    bool follow(const Request& made, Job& job);
    bool superseded(const Job& job) const;  ///< Returns whether there is a newer request.
    int limit() const;
    /// Throws Stale if the thread has to end or, with `first_is_there`, if a request is waiting that the samples do not
    /// serve, or work. With `samples`, whole samples exist, and only work that interrupts counts.
    void go_on(const Job& job, bool first_is_there, bool samples) const;
    /// Performs the work that waits, unless some of it interrupts.
    void do_work_between_samples();
    void work(const Work& work);
    /// Adds the wanted mattes to a picture of `samples` samples.
    void add_mattes(RendererCache& renderers, const Job& job, int divisor, int samples, Picture& picture);
    /// Shows what a StepWatch reports.
    void show_step(const char* what);
    /// Waits a short time for a camera at rest. Throws Stale if another request or work comes within that time.
    void settle(std::uint64_t number);
    /// Waits until more samples, another request or other work is wanted.
    void hold(RendererCache& renderers, std::uint64_t number, int samples);
    /// Reloads shaders that have changed. Throws Stale if programs have changed.
    void take_shaders(RendererCache& renderers);
    /// Waits until done() is true, and reloads shaders meanwhile. Throws what take_shaders() throws.
    template <class F>
    void wait(RendererCache& renderers, std::unique_lock<std::mutex>& lock, const F& done);

    const Options options_;
    gpu::ShaderWatch shaders_;      // used by the thread only, like the next three members
    bool compiled_ = false;         // programs have been compiled since the picture was begun
    double shaders_looked_at_ = 0;  // time of the last check of shader files, seconds
    double counted_ = 0;            // time of the last call of Options::changed() by count(), seconds
    mutable std::mutex mutex_;      // guards all members below
    std::condition_variable wake_;
    Request wanted_;
    std::uint64_t number_ = 0;  // number of `wanted_`
    double since_ = 0;          // time of `wanted_`, seconds
    int limit_ = 1;
    std::deque<Work> work_;
    bool stop_ = false;
    std::uint64_t view_ = 0;  // Picture::view of `wanted_`
    std::shared_ptr<const Picture> picture_, complete_;
    Status status_;
    std::thread thread_;  // last member, so that all others exist when it starts
};

}  // namespace halflight::view
