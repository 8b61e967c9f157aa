// Renders what is wanted last, on a thread and a context of its own: a coarse picture in time, then the whole one,
// better and better while nothing else is wanted. That one is the unbiased mean that `halflight render` makes of so
// many samples, bit for bit.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "passes/render.h"
#include "tools/halflight/scene_edits.h"

namespace halflight::view {

class Workplace;

/// All that a picture depends on.
struct Request {
    std::shared_ptr<const Scene> scene;  // before its edits; not null
    SceneEdits edits;
    Camera camera;
    ivec2 size{0};  // pixels
    int bounces = 8;
    std::vector<std::string> aovs;
    bool measure = false;  // RenderSettings::measure
};

struct Picture {
    std::uint64_t request = 0;  // number of the one that it was made for
    int divisor = 1;            // of the request's size in both directions: 1 is the whole picture
    double seconds = 0;         // since the request
    Camera camera;              // of the request
    std::vector<std::string> aovs;
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
    /// compiled, a picture that is being made of the samples.
    ~RenderThread();

    /// Never waits. From now on this is wanted and nothing else; returns its number, 1 for the first one. Requests may
    /// come faster than pictures: one whose first picture is under way is shown all the same.
    std::uint64_t show(Request request);
    /// How many samples a whole picture gets; it goes on where more are wanted. The picture of exactly so many is
    /// always published, except where more are there or under way: then the one with which it stops. Of fewer, those
    /// are that come as fast as they can be looked at.
    void limit(int samples);

    std::shared_ptr<const Picture> picture() const;  ///< the newest one; null at first
    struct Status {
        std::string device;        // name of its renderer; empty until it is there
        std::string activity;      // what it does, for people; empty: nothing
        std::string error;         // why request `failed` has no picture
        std::uint64_t failed = 0;  // 0: none has failed since the last one that did not
        bool ended = false;        // for good: there is no device
    };
    Status status() const;

  private:
    struct Stale {};  // what is being made is not wanted any more

    void run(ColorConfig colors);
    void serve(Workplace& place, const Request& request, std::uint64_t number, double since);
    void refine(Workplace& place, const Request& request, std::uint64_t number, double since, bool shown);
    void publish(Picture picture);
    void say(std::string activity);
    void fail(std::uint64_t number, std::string error, bool for_good);
    /// Throws Stale where the thread is to end and, if `first_is_there`, where something else is wanted.
    void go_on(std::uint64_t number, bool first_is_there) const;
    /// Throws Stale if something else is wanted within the time.
    void settle(std::uint64_t number);
    /// While there are as many samples as wanted; `limit`: of which the picture is published if they are `samples`.
    /// Throws Stale.
    void hold(std::uint64_t number, int samples, int limit);

    const Options options_;
    mutable std::mutex mutex_;  // of all that follows
    std::condition_variable wake_;
    Request wanted_;
    std::uint64_t number_ = 0;  // of `wanted_`
    double since_ = 0;          // when it was wanted, seconds
    int limit_ = 1;
    bool stop_ = false;
    std::shared_ptr<const Picture> picture_;
    Status status_;
    std::thread thread_;  // last: all else is there when it starts
};

}  // namespace halflight::view
