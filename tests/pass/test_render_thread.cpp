// The viewer's render thread: a coarse picture first, then the mean that `render` makes, bit for bit.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <mutex>
#include <thread>

#include "tests/cli/process.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"
#include "tools/view/render_thread.h"

namespace halflight::view {
namespace {

using test::expect_same;

/// A render thread, and all pictures that it has published.
class Watched {
  public:
    explicit Watched(double budget = 1e6)
        : thread_(ColorConfig::load(), {.context = {.device = "software"}, .budget = budget, .changed = [this] {
                                            const std::lock_guard lock(mutex_);
                                            changed_ = true;
                                            const auto newest = thread_.picture();
                                            if (newest != newest_) published_.push_back(newest);
                                            newest_ = newest;
                                            wake_.notify_all();
                                        }}) {}

    RenderThread& operator*() { return thread_; }
    RenderThread* operator->() { return &thread_; }

    /// Looks at whatever comes, picture by picture, until done() holds; false where it does not within minutes.
    template <class F>
    bool until(const F& done) {
        const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(4);
        for (;;) {
            if (done()) return true;
            std::unique_lock lock(mutex_);
            if (!wake_.wait_until(lock, end, [&] { return changed_ || !published_.empty(); })) return false;
            changed_ = false;
            if (published_.empty()) continue;
            seen.push_back(published_.front());
            published_.pop_front();
        }
    }
    /// Until the whole picture of a request has so many samples.
    bool until_samples(std::uint64_t request, int samples) {
        return until([&] {
            return !seen.empty() && seen.back()->request == request && seen.back()->divisor == 1 &&
                   seen.back()->result.stats.samples == samples;
        });
    }

    std::vector<std::shared_ptr<const Picture>> seen;  // none is missed

  private:
    std::mutex mutex_;
    std::condition_variable wake_;
    bool changed_ = false;
    std::deque<std::shared_ptr<const Picture>> published_;  // that are still to be looked at
    std::shared_ptr<const Picture> newest_;
    RenderThread thread_;
};

class RenderThreadTest : public GpuTest {
  protected:
    Request request() const {
        Request r;
        r.scene = scene;
        r.camera = scene->cameras[0];
        r.size = {60, 45};
        r.bounces = 3;
        return r;
    }
    /// What `render` makes of the same.
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

    std::shared_ptr<const Scene> scene = std::make_shared<const Scene>(test::shiny_cornell());
};

TEST_F(RenderThreadTest, TheMeanIsThatOfRender) {
    Watched thread;
    Request r = request();
    for (const AovInfo& aov : known_aovs())
        if (!aov.debug) r.aovs.emplace_back(aov.name);
    thread->limit(5);
    const std::uint64_t number = thread->show(r);
    EXPECT_EQ(number, 1u);
    ASSERT_TRUE(thread.until_samples(number, 5)) << thread->status().error;
    expect_same(thread.seen.back()->result, expected(r, 5));
    EXPECT_EQ(thread.seen.back()->aovs, r.aovs);
    EXPECT_TRUE(thread.seen.back()->result.stats.passes.empty()) << "nobody has asked for times";
    // It goes on where it was.
    thread->limit(7);
    ASSERT_TRUE(thread.until_samples(number, 7));
    expect_same(thread.seen.back()->result, expected(r, 7));
    for (const auto& picture : thread.seen) {
        EXPECT_EQ(picture->request, number);
        EXPECT_LE(picture->result.stats.samples, 7);
    }
}

TEST_F(RenderThreadTest, TheFirstPictureIsCoarse) {
    Watched thread;
    Request r = request();
    thread->show(r);
    ASSERT_TRUE(thread.until([&] { return !thread.seen.empty(); })) << thread->status().error;
    EXPECT_EQ(thread.seen[0]->divisor, 8) << "nothing is known of how long it takes";
    EXPECT_EQ(thread.seen[0]->result.beauty.width, 8);
    EXPECT_EQ(thread.seen[0]->result.beauty.height, 6);
    ASSERT_TRUE(thread.until_samples(1, 1));
    // All the time in the world, which it knows once it has taken a time: whole pictures from then on.
    r.camera.camera_to_world[3].x += 0.1;
    ASSERT_TRUE(thread.until_samples(thread->show(r), 1));
    r.camera.camera_to_world[3].x += 0.1;
    const std::uint64_t third = thread->show(r);
    ASSERT_TRUE(thread.until_samples(third, 1));
    expect_same(thread.seen.back()->result, expected(r, 1));
    for (const auto& picture : thread.seen) EXPECT_TRUE(picture->request != third || picture->divisor == 1);

    Watched hasty(1e-9);
    for (int i = 0; i < 3; ++i) {
        r.camera.camera_to_world[3].x += 0.1;
        ASSERT_TRUE(hasty.until_samples(hasty->show(r), 1));
    }
    hasty->show(request());
    ASSERT_TRUE(hasty.until([&] { return hasty.seen.back()->request == 4; }));
    EXPECT_EQ(hasty.seen.back()->divisor, 16) << "nothing is fast enough";
}

TEST_F(RenderThreadTest, TheNewestIsWhatIsMade) {
    Watched thread;
    thread->limit(1 << 24);
    Request r = request();
    std::uint64_t last = 0;
    for (int i = 0; i < 20; ++i) {
        r.camera.camera_to_world[3].x += 0.01;
        last = thread->show(r);
    }
    EXPECT_EQ(last, 20u);
    ASSERT_TRUE(thread.until([&] { return !thread.seen.empty() && thread.seen.back()->request == last; }));
    // A request that comes while a picture gets better and better ends that one.
    r.camera.camera_to_world[3].y += 0.1;
    last = thread->show(r);
    ASSERT_TRUE(thread.until([&] { return thread.seen.back()->request == last; }));
    thread->limit(1);
    for (std::size_t i = 1; i < thread.seen.size(); ++i)
        EXPECT_LE(thread.seen[i - 1]->request, thread.seen[i]->request);
}

TEST_F(RenderThreadTest, TheRadianceCacheLivesWhileOnlyTheCameraMoves) {
    Watched thread;
    Request r = request();
    r.modes.preview.cache = true;
    thread->limit(2);
    const auto picture = [&](const Request& wanted) {
        const std::uint64_t number = thread->show(wanted);
        EXPECT_TRUE(thread.until_samples(number, 2)) << thread->status().error;
        return thread.seen.back()->result;
    };
    const RenderResult cold = picture(r);
    EXPECT_EQ(cold.stats.biases.size(), 1u);
    Request other = r;
    other.camera.camera_to_world[3].x += 0.1;
    picture(other);
    const RenderResult warm = picture(r);
    EXPECT_FALSE(same_bits(warm.beauty, cold.beauty));
    Request dark = r;
    dark.edits.emission = 0.25f;
    picture(dark);
    expect_same(picture(r), cold);  // each change of lights has emptied it
    Request less = r;
    less.bounces = 2;
    picture(less);
    expect_same(picture(r), cold);
}

TEST_F(RenderThreadTest, LightsAndMaterialsAreEdited) {
    Watched thread;
    thread->limit(2);
    Request r = request();
    ASSERT_TRUE(thread.until_samples(thread->show(r), 2));
    const auto plain = thread.seen.back();
    r.edits.clay = true;
    r.edits.emission = 0.25f;
    ASSERT_TRUE(thread.until_samples(thread->show(r), 2));
    expect_same(thread.seen.back()->result, expected(r, 2));
    EXPECT_FALSE(same_bits(thread.seen.back()->result.beauty, plain->result.beauty));
    r.edits = {};
    r.measure = true;
    ASSERT_TRUE(thread.until_samples(thread->show(r), 2));
    expect_same(thread.seen.back()->result, plain->result);
    EXPECT_FALSE(thread.seen.back()->result.stats.passes.empty());
}

TEST_F(RenderThreadTest, ComponentsNeedNoNewSamples) {
    Watched thread;
    thread->limit(3);
    Request r = request();
    r.aovs = {"variance"};
    ASSERT_TRUE(thread.until_samples(thread->show(r), 3));
    const auto first = thread.seen.back();
    EXPECT_FALSE(first->relmse) << "too few samples to tell";
    Request parts = r;
    parts.aovs = {"direct_diffuse", "indirect_diffuse"};
    const std::uint64_t number = thread->show(parts);
    ASSERT_TRUE(thread.until_samples(number, 3));
    expect_same(thread.seen.back()->result, expected(parts, 3));
    EXPECT_GT(thread.seen.back()->seconds, first->seconds) << "they are as old as the samples";
    // They go on where they were, and what was gathered is still there.
    thread->limit(5);
    ASSERT_TRUE(thread.until_samples(number, 5));
    const std::uint64_t again = thread->show(r);
    ASSERT_TRUE(thread.until_samples(again, 5));
    expect_same(thread.seen.back()->result, expected(r, 5));
    EXPECT_GT(thread.seen.back()->relmse.value(), 0);
    for (const auto& picture : thread.seen) {
        EXPECT_TRUE(picture->request != number || picture->result.stats.samples >= 3) << "it has begun anew";
        EXPECT_TRUE(picture->request != again || picture->result.stats.samples == 5) << "it has begun anew";
    }
}

TEST_F(RenderThreadTest, PreviewModesSayWhatTheyDo) {
    Watched thread;
    thread->limit(2);
    Request r = request();
    r.modes.clamp = 0.01f;
    ASSERT_TRUE(thread.until_samples(thread->show(r), 2));
    EXPECT_EQ(thread.seen.back()->result.stats.biases.size(), 1u);
    const auto clamped = thread.seen.back();
    r.modes = {};
    ASSERT_TRUE(thread.until_samples(thread->show(r), 2));
    EXPECT_TRUE(thread.seen.back()->result.stats.biases.empty());
    EXPECT_FALSE(same_bits(thread.seen.back()->result.beauty, clamped->result.beauty));
}

TEST_F(RenderThreadTest, CullingIsChosen) {
    Watched thread;
    thread->limit(2);
    Request r = request();
    r.measure = true;
    for (const auto culling : {rays::Culling::raster, rays::Culling::off, rays::Culling::compute}) {
        SCOPED_TRACE(rays::name(culling));
        r.culling = culling;
        ASSERT_TRUE(thread.until_samples(thread->show(r), 2)) << thread->status().error;
        expect_same(thread.seen.back()->result, expected(r, 2));
        EXPECT_EQ(thread.seen.back()->result.stats.raster.empty(), culling != rays::Culling::raster);
    }
}

TEST_F(RenderThreadTest, OtherWorkComesBetween) {
    Watched thread;
    std::string activity;
    const std::thread::id here = std::this_thread::get_id();
    std::thread::id there = here;
    std::atomic<bool> done = false;
    const auto work = [&] {
        activity = thread->status().activity;
        there = std::this_thread::get_id();
        done = true;
    };
    thread->perform("reading", work);
    ASSERT_TRUE(thread.until([&] { return done.load(); })) << "nothing else is wanted";
    EXPECT_EQ(activity, "reading");
    EXPECT_NE(there, here);
    // While a picture gets better and better, and while it is as good as wanted; it goes on afterwards.
    Request r = request();
    thread->limit(1 << 24);
    const std::uint64_t number = thread->show(r);
    ASSERT_TRUE(thread.until([&] { return !thread.seen.empty(); }));
    done = false;
    thread->perform("reading", work);
    ASSERT_TRUE(thread.until([&] { return done.load(); }));
    thread->limit(1);
    const std::size_t before = thread.seen.size();
    ASSERT_TRUE(thread.until([&] { return thread.seen.size() > before && thread.seen.back()->divisor == 1; }));
    EXPECT_EQ(thread.seen.back()->request, number);
    done = false;
    thread->perform("reading", work);
    ASSERT_TRUE(thread.until([&] { return done.load(); }));
    thread->limit(2);
    ASSERT_TRUE(thread.until_samples(number, 2));
    expect_same(thread.seen.back()->result, expected(r, 2));
}

/// Shaders of one's own, as HALFLIGHT_SHADERS has them.
class OwnShaders {
  public:
    OwnShaders() {
        std::filesystem::copy(std::filesystem::path(HALFLIGHT_SOURCE_DIR) / "shaders", folder_.path,
                              std::filesystem::copy_options::recursive);
        setenv("HALFLIGHT_SHADERS", folder_.path.c_str(), 1);
    }
    ~OwnShaders() { unsetenv("HALFLIGHT_SHADERS"); }
    OwnShaders(const OwnShaders&) = delete;
    OwnShaders& operator=(const OwnShaders&) = delete;

    std::string read(const std::string& name) const { return test::read_text(folder_ / name); }
    /// All at once: nobody sees half of it.
    void write(const std::string& name, const std::string& text) const {
        test::write_text(drafts_ / name, text);
        std::filesystem::rename(drafts_ / name, folder_ / name);
    }

  private:
    test::TemporaryFolder folder_, drafts_;
};

TEST_F(RenderThreadTest, ShadersAreTakenWhenTheyChange) {
    const RenderResult plain = expected(request(), 2);
    const OwnShaders shaders;
    Watched thread;
    thread->limit(2);
    const std::uint64_t number = thread->show(request());
    ASSERT_TRUE(thread.until_samples(number, 2)) << thread->status().error;
    expect_same(thread.seen.back()->result, plain);

    // Where nothing is to be done but to wait: a picture in twice the light.
    const std::string name = "accumulate.comp", good = shaders.read(name);
    const std::string from = "vec3 emission = guarded(point.emission, kCountGBuffer);";
    const std::size_t at = good.find(from);
    ASSERT_NE(at, std::string::npos);
    const auto edited = [&](const std::string& to) { return std::string(good).replace(at, from.size(), to); };
    shaders.write(name, edited("vec3 emission = 2.0 * guarded(point.emission, kCountGBuffer);"));
    const auto brighter = [&] {
        const auto& last = thread.seen.back();
        return last->divisor == 1 && last->result.stats.samples == 2 && !same_bits(last->result.beauty, plain.beauty);
    };
    ASSERT_TRUE(thread.until(brighter));
    EXPECT_GE(thread->status().reloads, 1u);
    const auto bright = thread.seen.back();

    // One that does not compile is told, and the old one goes on.
    shaders.write(name, edited("vec3 emission = nonsense;"));
    ASSERT_TRUE(thread.until([&] { return !thread->status().shader_error.empty(); }));
    const std::string error = thread->status().shader_error;
    EXPECT_TRUE(error.starts_with("shaders/accumulate.comp:")) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos);
    EXPECT_EQ(thread->picture(), bright);
    thread->limit(3);
    ASSERT_TRUE(thread.until_samples(number, 3)) << "it goes on where it was";
    EXPECT_NE(thread->status().shader_error, "");

    // Mended, while there is a lot to do.
    thread->limit(1 << 24);
    shaders.write(name, good);
    ASSERT_TRUE(thread.until([&] { return thread->status().shader_error.empty(); }));
    EXPECT_GE(thread->status().reloads, 2u);
    thread->limit(2);
    Request moved = request();
    moved.bounces = 2;
    ASSERT_TRUE(thread.until_samples(thread->show(moved), 2));
    expect_same(thread.seen.back()->result, expected(moved, 2));
}

TEST_F(RenderThreadTest, AShaderThatWasBrokenAtTheStartCanBeMended) {
    const RenderResult plain = expected(request(), 1);
    const OwnShaders shaders;
    const std::string good = shaders.read("accumulate.comp");
    shaders.write("accumulate.comp", good + "nonsense;\n");
    Watched thread;
    const std::uint64_t number = thread->show(request());
    ASSERT_TRUE(thread.until([&] { return thread->status().failed == number; }));
    EXPECT_TRUE(thread->status().error.starts_with("shaders/accumulate.comp:")) << thread->status().error;
    shaders.write("accumulate.comp", good);
    ASSERT_TRUE(thread.until_samples(number, 1));
    expect_same(thread.seen.back()->result, plain);
    EXPECT_EQ(thread->status().error, "");
}

TEST_F(RenderThreadTest, AnErrorKeepsThePicture) {
    Watched thread;
    Request good = request();
    ASSERT_TRUE(thread.until_samples(thread->show(good), 1));
    const auto before = thread.seen.back();
    Request bad = good;
    Scene broken = *scene;
    broken.instances[0].mesh = 1000;
    bad.scene = std::make_shared<const Scene>(broken);
    const std::uint64_t number = thread->show(bad);
    ASSERT_TRUE(thread.until([&] { return thread->status().failed == number; }));
    EXPECT_NE(thread->status().error, "");
    EXPECT_FALSE(thread->status().ended);
    EXPECT_EQ(thread->picture(), before);
    ASSERT_TRUE(thread.until_samples(thread->show(good), 1));
    EXPECT_EQ(thread->status().error, "");
    EXPECT_EQ(thread->status().failed, 0u);
}

TEST_F(RenderThreadTest, NoDeviceIsAnError) {
    RenderThread thread(ColorConfig::load(), {.context = {.device = "no such device"}});
    while (!thread.status().ended) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    EXPECT_NE(thread.status().error.find("no such device"), std::string::npos) << thread.status().error;
    thread.show(request());  // of no use, but no harm
}

TEST_F(RenderThreadTest, EndsInTheMiddle) {
    Watched thread;
    thread->limit(1 << 24);
    Request r = request();
    r.size = {512, 512};
    thread->show(r);
    ASSERT_TRUE(thread.until([&] { return !thread.seen.empty(); }));
}

}  // namespace
}  // namespace halflight::view
