// Tests the viewer's render thread: a coarse picture comes first, then the picture of `render`, bit for bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include "tests/pass/renderer/render_threads.h"
#include "tools/view/region.h"

namespace halflight::view {
namespace {

using test::expect_includes;
using test::expect_same;
using test::layer;
using test::small_settings;

TEST_F(RenderThreadTest, ThePictureEqualsThatOfRender) {
    RecordingThread thread;
    Request r = request();
    for (const AovInfo& aov : known_aovs())
        if (aov.in_all()) r.aovs.emplace_back(aov.name);
    const auto five = expect_rendered(thread, r, 5);
    for (const std::string& aov : r.aovs) EXPECT_EQ(std::ranges::count(five->aovs, aov), 1) << aov;
    EXPECT_TRUE(five->result.stats.passes.empty()) << "times were not requested";
    // Rendering continues from the samples so far.
    thread->limit(7);
    ASSERT_TRUE(thread.until_samples(five->request, 7));
    expect_includes(thread.pictures.back()->result, expected(r, 7));
    EXPECT_EQ(thread->status().samples, 7);
    for (const auto& picture : thread.pictures) {
        EXPECT_EQ(picture->request, five->request);
        EXPECT_LE(picture->result.stats.samples, 7);
    }
}

TEST_F(RenderThreadTest, TheFirstPictureIsCoarse) {
    RecordingThread thread;
    Request r = request();
    thread->show(r);
    ASSERT_TRUE(thread.until([&] { return !thread.pictures.empty(); })) << thread->status().error;
    EXPECT_EQ(thread.pictures[0]->divisor, 8) << "no time has been recorded";
    EXPECT_EQ(thread.pictures[0]->result.beauty.width, 8);
    EXPECT_EQ(thread.pictures[0]->result.beauty.height, 6);
    ASSERT_TRUE(thread.until_samples(1, 1));
    // The budget is large, so all pictures have full resolution once a time has been recorded.
    r.camera.camera_to_world[3].x += 0.1;
    thread.take(r, 1);
    r.camera.camera_to_world[3].x += 0.1;
    const std::uint64_t third = expect_rendered(thread, r, 1)->request;
    for (const auto& picture : thread.pictures) EXPECT_TRUE(picture->request != third || picture->divisor == 1);

    RecordingThread hasty(1e-9);
    for (int i = 0; i < 3; ++i) {
        r.camera.camera_to_world[3].x += 0.1;
        hasty.take(r, 1);
    }
    hasty->show(request());
    ASSERT_TRUE(hasty.until([&] { return hasty.pictures.back()->request == 4; }));
    EXPECT_EQ(hasty.pictures.back()->divisor, 16) << "no resolution is within the budget";
}

TEST_F(RenderThreadTest, TheNewestRequestIsRendered) {
    RecordingThread thread;
    thread->limit(1 << 24);
    Request r = request();
    std::uint64_t last = 0;
    for (int i = 0; i < 20; ++i) {
        r.camera.camera_to_world[3].x += 0.01;
        last = thread->show(r);
    }
    EXPECT_EQ(last, 20u);
    ASSERT_TRUE(thread.until([&] { return !thread.pictures.empty() && thread.pictures.back()->request == last; }));
    // A new request ends the refinement of the previous picture.
    r.camera.camera_to_world[3].y += 0.1;
    last = thread->show(r);
    ASSERT_TRUE(thread.until([&] { return thread.pictures.back()->request == last; }));
    thread->limit(1);
    for (std::size_t i = 1; i < thread.pictures.size(); ++i)
        EXPECT_LE(thread.pictures[i - 1]->request, thread.pictures[i]->request);
}

TEST_F(RenderThreadTest, TheRadianceCacheLivesWhileOnlyTheCameraMoves) {
    RecordingThread thread;
    Request r = request();
    r.modes.preview.cache = true;
    const auto picture = [&](const Request& wanted) { return thread.take(wanted, 2)->result; };
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
    const RenderResult emptied = picture(r);  // the first picture is whole, because times have been recorded
    picture(other);
    picture(dark);
    expect_same(picture(r), emptied);  // each change of lights has emptied the cache
    Request less = r;
    less.bounces = 2;
    picture(less);
    expect_same(picture(r), cold);
}

TEST_F(RenderThreadTest, LightsAndMaterialsAreEdited) {
    RecordingThread thread;
    Request r = request();
    const auto plain = thread.take(r, 2);
    r.edits.clay = true;
    for (const float emission : {0.25f, 0.5f}) {
        r.edits.emission = emission;
        const auto edited = expect_rendered(thread, r, 2);
        EXPECT_FALSE(same_bits(edited->result.beauty, plain->result.beauty));
        EXPECT_EQ(edited->result.stats.hierarchies.built, 0u) << "hierarchies are kept";
    }
    r.edits = {};
    r.measure = true;
    const auto again = thread.take(r, 2);
    expect_same(again->result, plain->result);
    EXPECT_FALSE(again->result.stats.passes.empty());
}

TEST_F(RenderThreadTest, ComponentsNeedNoNewSamples) {
    RecordingThread thread;
    Request r = request();
    r.aovs = {"variance"};
    const auto first = thread.take(r, 3);
    EXPECT_FALSE(first->relmse) << "too few samples for an estimate";
    Request parts = r;
    parts.aovs = {"direct_diffuse", "indirect_diffuse"};
    const auto second = expect_rendered(thread, parts, 3);
    const std::uint64_t number = second->request;
    EXPECT_GT(second->seconds, first->seconds) << "their age is that of the samples";
    // Rendering continues from the samples so far, and their AOVs are kept.
    thread->limit(5);
    ASSERT_TRUE(thread.until_samples(number, 5));
    const auto third = expect_rendered(thread, r, 5);
    const std::uint64_t again = third->request;
    EXPECT_GT(third->relmse.value(), 0);
    for (const auto& picture : thread.pictures) {
        EXPECT_TRUE(picture->request != number || picture->result.stats.samples >= 3) << "rendering has restarted";
        EXPECT_TRUE(picture->request != again || picture->result.stats.samples == 5) << "rendering has restarted";
    }
}

TEST_F(RenderThreadTest, RegionsTakeFurtherSamplesAndKeepAll) {
    RecordingThread thread;
    const auto until = [&](std::uint64_t request, int samples, bool region) {
        return thread.until([&] {
            const Picture* newest = thread.pictures.empty() ? nullptr : thread.pictures.back().get();
            return newest && newest->request == request && newest->samples() == samples &&
                   newest->region.has_value() == region;
        });
    };
    thread->limit(2);
    Request r = request();
    r.aovs = {"variance", "albedo", "depth"};
    ASSERT_TRUE(until(thread->show(r), 2, false)) << thread->status().error;
    const RenderResult two = expected(r, 2), six = expected(r, 6);
    Request part = r;
    part.region = PixelWindow{{20, 10}, {41, 33}};  // no multiples of a block
    const std::uint64_t number = thread->show(part);
    ASSERT_TRUE(until(number, 2, true)) << "it begins with the samples that are there";
    expect_includes(thread.pictures.back()->result, two);
    thread->limit(6);
    ASSERT_TRUE(until(number, 6, true)) << thread->status().error;
    const auto expect_pixels = [&](const Image& made, const Image& inside, const Image& outside) {
        for (int y = 0; y < made.height; ++y) {
            for (int x = 0; x < made.width; ++x) {
                for (int c = 0; c < made.channels; ++c) {
                    const float value = made.at(x, y)[c];
                    if (contains(*part.region, {x, y}))
                        ASSERT_NEAR(value, inside.at(x, y)[c], 1e-5f * (1 + std::abs(value))) << x << ", " << y;
                    else
                        ASSERT_EQ(value, outside.at(x, y)[c]) << x << ", " << y;
                }
            }
        }
    };
    const auto seen = thread.pictures.back();
    expect_pixels(seen->result.beauty, six.beauty, two.beauty);
    for (const char* channel : {"albedo.R", "Z"})
        expect_pixels(layer(seen->result, channel), layer(six, channel), layer(two, channel));
    EXPECT_EQ(seen->result.stats.samples, 2);
    EXPECT_EQ(seen->view, 1u);

    // The picture goes on from its own samples, and the region stays until the rest has as many.
    thread->limit(4);
    const std::uint64_t again = thread->show(r);
    ASSERT_TRUE(until(again, 4, false));
    expect_pixels(thread.pictures.back()->result.beauty, six.beauty, expected(r, 4).beauty);
    thread->limit(6);
    ASSERT_TRUE(until(again, 6, false));
    expect_includes(thread.pictures.back()->result, six);
    for (const auto& picture : thread.pictures)
        EXPECT_TRUE(picture->request == 1 || picture->samples() >= 2) << "rendering has restarted";

    // In a new view the whole picture takes one sample first.
    part.camera.camera_to_world[3].x += 0.1;
    thread->limit(3);
    ASSERT_TRUE(until(thread->show(part), 3, true));
    EXPECT_EQ(thread.pictures.back()->result.stats.samples, 1);

    // Edits of lights and nodes reach the region, too.
    part.edits.emission = 0.25f;
    dmat4& place = part.edits.transforms[0] = part.scene->instances[0].object_to_world;
    place[3].x += 0.2;
    ASSERT_TRUE(until(thread->show(part), 3, true));
    expect_pixels(thread.pictures.back()->result.beauty, expected(part, 3).beauty, expected(part, 1).beauty);

    // Another pose of the scene reaches the region as well, and the renderer of the whole picture is kept.
    part.edits = {};
    ASSERT_TRUE(until(thread->show(part), 3, true));
    auto pose = std::make_shared<Scene>(*part.scene);
    pose->instances[1].object_to_world[3].x += 0.2;
    part.scene = pose;
    const auto posed = [&](int samples) {
        Renderer renderer(context, *part.reference, ColorConfig::load(),
                          small_settings(part.camera, part.size.x, part.size.y, samples, part.bounces));
        renderer.update(*pose);
        return renderer.render().beauty;
    };
    ASSERT_TRUE(until(thread->show(part), 3, true));
    expect_pixels(thread.pictures.back()->result.beauty, posed(3), posed(1));
}

TEST_F(RenderThreadTest, PreviewModesReportTheirBias) {
    RecordingThread thread;
    Request r = request();
    r.modes.clamp = 0.01f;
    const auto clamped = thread.take(r, 2);
    EXPECT_EQ(clamped->result.stats.biases.size(), 1u);
    r.modes = {};
    const auto plain = thread.take(r, 2);
    EXPECT_TRUE(plain->result.stats.biases.empty());
    EXPECT_FALSE(same_bits(plain->result.beauty, clamped->result.beauty));
}

TEST_F(RenderThreadTest, CullingIsChosen) {
    RecordingThread thread;
    Request r = request();
    r.measure = true;
    for (const auto culling : {rays::Culling::raster, rays::Culling::off, rays::Culling::compute}) {
        SCOPED_TRACE(rays::name(culling));
        r.culling = culling;
        const auto picture = expect_rendered(thread, r, 2);
        EXPECT_EQ(picture->result.stats.raster.empty(), culling != rays::Culling::raster);
    }
}

TEST_F(RenderThreadTest, OtherWorkIsPerformedBetweenPictures) {
    RecordingThread thread;
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
    ASSERT_TRUE(thread.until([&] { return done.load(); })) << "there is no other request";
    EXPECT_EQ(activity, "reading");
    EXPECT_NE(there, here);
    // Work arrives during refinement and after its end. Rendering continues afterwards.
    Request r = request();
    thread->limit(1 << 24);
    const std::uint64_t number = thread->show(r);
    ASSERT_TRUE(thread.until([&] { return !thread.pictures.empty(); }));
    done = false;
    thread->perform("reading", work);
    ASSERT_TRUE(thread.until([&] { return done.load(); }));
    thread->limit(1);
    const std::size_t before = thread.pictures.size();
    ASSERT_TRUE(thread.until([&] { return thread.pictures.size() > before && thread.pictures.back()->divisor == 1; }));
    EXPECT_EQ(thread.pictures.back()->request, number);
    done = false;
    thread->perform("reading", work);
    ASSERT_TRUE(thread.until([&] { return done.load(); }));
    thread->limit(2);
    ASSERT_TRUE(thread.until_samples(number, 2));
    expect_includes(thread.pictures.back()->result, expected(r, 2));
}

TEST_F(RenderThreadTest, PosesFollowFromTheirReference) {
    Scene moved = *scene;
    moved.instances[1].object_to_world[3].x += 0.2;
    const auto posed = std::make_shared<const Scene>(moved);
    const auto expected_pose = [&](const Request& r) {
        RenderSettings s = small_settings(r.camera, r.size.x, r.size.y, 2, r.bounces);
        s.aovs = r.aovs;
        s.frame = r.frame;
        Renderer renderer(context, *r.reference, ColorConfig::load(), s);
        renderer.update(*r.scene);
        return renderer.render();
    };
    Request r = request();
    r.scene = posed;
    r.frame = 3;
    {
        RecordingThread thread;  // a new thread, which has not rendered the reference
        expect_includes(thread.take(r, 2)->result, expected_pose(r));
    }
    RecordingThread thread;
    const auto first = thread.take(request(), 2);
    const auto second = thread.take(r, 2);
    expect_includes(second->result, expected_pose(r));
    EXPECT_FALSE(same_bits(first->result.beauty, second->result.beauty));
    expect_same(thread.take(request(), 2)->result, first->result);
}

TEST_F(RenderThreadTest, MotionIsRelativeToThePreviousView) {
    RecordingThread thread;
    Request r = request();
    r.aovs = {"motion"};
    const auto largest = [&](const Request& wanted) {
        float most = 0;
        for (const float v : layer(thread.take(wanted, 1)->result, "motion.X").pixels)
            most = std::max(most, std::abs(v));
        return most;
    };
    EXPECT_LT(largest(r), 0.01f);
    r.camera.camera_to_world[3] += 0.1 * r.camera.camera_to_world[0];
    EXPECT_GT(largest(r), 1.0f);
    const auto of_camera = thread.pictures.back();
    Scene moved = *scene;
    moved.instances[1].object_to_world[3].x += 0.2;
    r.scene = std::make_shared<const Scene>(moved);
    EXPECT_GT(largest(r), 1.0f);
    EXPECT_FALSE(same_bits(layer(of_camera->result, "motion.X"), layer(thread.pictures.back()->result, "motion.X")));
}

TEST_F(RenderThreadTest, AnErrorKeepsThePicture) {
    RecordingThread thread;
    Request good = request();
    const auto before = thread.take(good, 1);
    Request bad = good;
    Scene broken = *scene;
    broken.instances[0].mesh = 1000;
    bad.scene = std::make_shared<const Scene>(broken);
    const std::uint64_t number = thread->show(bad);
    ASSERT_TRUE(thread.until([&] { return thread->status().failed == number; }));
    EXPECT_NE(thread->status().error, "");
    EXPECT_FALSE(thread->status().ended);
    EXPECT_EQ(thread->picture(), before);
    thread.take(good, 1);
    EXPECT_EQ(thread->status().error, "");
    EXPECT_EQ(thread->status().failed, 0u);
}

TEST_F(RenderThreadTest, NoDeviceIsAnError) {
    RenderThread thread(ColorConfig::load(), {.context = {.device = "no such device"}});
    while (!thread.status().ended) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    EXPECT_NE(thread.status().error.find("no such device"), std::string::npos) << thread.status().error;
    thread.show(request());  // the call has no effect
}

TEST_F(RenderThreadTest, EndsWhileRendering) {
    RecordingThread thread;
    thread->limit(1 << 24);
    Request r = request();
    r.size = {512, 512};
    thread->show(r);
    ASSERT_TRUE(thread.until([&] { return !thread.pictures.empty(); }));
}

}  // namespace
}  // namespace halflight::view
