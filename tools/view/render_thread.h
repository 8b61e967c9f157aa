// Renders what is wanted last, on a thread and a context of its own: a coarse picture in time, then the whole one,
// better and better while nothing else is wanted. That one is the unbiased mean that `halflight render` makes of so
// many samples, bit for bit, unless a preview mode says otherwise. Where HALFLIGHT_SHADERS names a folder, shaders that
// have changed there are taken.
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

#include "api/halflight/scene_edits.h"
#include "engine/gpu/shader_source.h"
#include "renderer/render.h"

namespace halflight::view {

class RendererCache;

/// What makes pictures better soon, and not the right ones in the end. RenderStats::biases names what they do.
struct PreviewModes {
    Preview preview{};  // RenderSettings::preview: the picture is a mean from some number of samples on
    float clamp = 0;    // RenderSettings::clamp
    bool operator==(const PreviewModes&) const = default;
};

inline constexpr int kMostSamples = 1 << 24;  ///< of a picture: a float32 counts no further

/// Names, too.
bool same(const Camera& a, const Camera& b);

/// All that a picture depends on.
struct Request {
    /// The scene as its file has it at 0 s, before edits: what pictures of any pose depend on, too
    /// (PreparedScene::update()). Poses of one reference have its images. Not null.
    std::shared_ptr<const Scene> reference;
    std::shared_ptr<const Scene> scene;  // at the frame, before edits; the reference itself where nothing moves
    SceneEdits edits;
    std::uint32_t frame = 0;  // FrameSettings::frame
    Camera camera;
    ivec2 size{0};  // pixels
    int bounces = 8;
    std::vector<std::string> aovs;
    PreviewModes modes{};
    rays::Culling culling = rays::Culling::automatic;
    bool measure = false;  // RenderSettings::measure
    bool operator==(const Request& other) const;
};
/// Whether the samples that are made for a request can be a picture for the other one, too: they differ in AOVs only,
/// and those are at hand.
bool serves(const Request& made, const Request& wanted);
/// Of the request's AOVs those that samples have to be made with.
std::vector<std::string> gathered(const Request& request);

struct Picture {
    std::uint64_t request = 0;       // number of the one that it was made for
    int divisor = 1;                 // of the request's size in both directions: 1 is the whole picture
    double seconds = 0;              // since the first request that its samples were made for
    Camera camera;                   // of the request
    std::vector<std::string> aovs;   // of the request, those of the result by name
    std::optional<double> relmse{};  // estimated_relmse(), of whole pictures
    RenderResult result;
};

class RenderThread {
  public:
    struct Options {
        gpu::ContextOptions context;
        double budget = 0.1;                    // seconds until the first picture of a request
        std::function<void()> changed = [] {};  // called from the thread whenever there is something new to see
    };
    RenderThread(ColorConfig colors, Options options);
    RenderThread(const RenderThread&) = delete;
    RenderThread& operator=(const RenderThread&) = delete;
    /// Waits for what the device is doing: a sample of a band, the preparing of a scene, shaders that are being
    /// compiled, a picture that is being made of the samples, what perform() has brought.
    ~RenderThread();

    /// Never waits. From now on this is wanted and nothing else; returns its number, 1 for the first one. Requests may
    /// come faster than pictures: one whose first picture is under way is shown all the same. Samples that are there go
    /// on where they serve() the new one, too.
    std::uint64_t show(Request request);
    /// How many samples a whole picture gets; it goes on where more are wanted. The picture of exactly so many is
    /// always published, except where more are there or under way: then the one with which it stops. Of fewer, those
    /// are that come as fast as they can be looked at.
    void limit(int samples);
    /// Never waits. As soon as it can the thread does this, which throws nothing, and has no time for pictures
    /// meanwhile. `activity`: of the status.
    void perform(std::string activity, std::function<void()> work);

    std::shared_ptr<const Picture> picture() const;  ///< the newest one; null at first
    struct Status {
        std::string device;         // name of its renderer; empty until it is there
        std::string activity;       // what it does, for people; empty: nothing
        std::string error;          // why request `failed` has no picture
        std::uint64_t failed = 0;   // 0: none has failed since the last one that did not
        std::string shader_error;   // why shaders that have changed are not used; empty: all are
        std::uint64_t reloads = 0;  // how many times files of shaders have changed and all were good
        bool ended = false;         // for good: there is no device
    };
    Status status() const;

  private:
    struct Stale {};  // what is being made is not wanted any more, or has to be made anew
    struct Job {
        Request request;
        std::uint64_t number = 0;
        double since = 0;  // when its view was wanted, seconds
    };
    struct Work {
        std::string activity;
        std::function<void()> work;
    };

    void run(ColorConfig colors);
    void serve(RendererCache& renderers, const Job& job);
    Picture coarse(RendererCache& renderers, const Job& job, int divisor);
    void refine(RendererCache& renderers, Job job, bool shown);  ///< shown: there is a coarse picture of it
    void publish(Picture picture);
    void say(std::string activity);
    void fail(std::uint64_t number, std::string error, bool for_good);
    /// What there is to do next, once there is something; nothing: the thread is to end.
    std::optional<std::variant<Job, Work>> next(RendererCache& renderers, std::uint64_t done, bool again);
    /// Whether the job has become that of another request, which the samples made serve, too.
    bool follow(const Request& made, Job& job);
    /// Throws Stale where the thread is to end and, if `first_is_there`, where something else is wanted.
    void go_on(std::uint64_t number, bool first_is_there) const;
    /// Throws Stale if something else is wanted within the time.
    void settle(std::uint64_t number);
    /// While there are as many samples as wanted, and nothing else is.
    void hold(RendererCache& renderers, std::uint64_t number, int samples);
    /// Shaders that have changed. Throws Stale where programs have.
    void take_shaders(RendererCache& renderers);
    /// Until done(), looking after shaders. Throws what take_shaders() throws.
    template <class F>
    void wait(RendererCache& renderers, std::unique_lock<std::mutex>& lock, const F& done);

    const Options options_;
    gpu::ShaderWatch shaders_;      // of the thread alone, as is the next one
    double shaders_looked_at_ = 0;  // seconds
    mutable std::mutex mutex_;      // of all that follows
    std::condition_variable wake_;
    Request wanted_;
    std::uint64_t number_ = 0;  // of `wanted_`
    double since_ = 0;          // when it was wanted, seconds
    int limit_ = 1;
    std::deque<Work> work_;
    bool stop_ = false;
    std::shared_ptr<const Picture> picture_;
    Status status_;
    std::thread thread_;  // last: all else is there when it starts
};

}  // namespace halflight::view
