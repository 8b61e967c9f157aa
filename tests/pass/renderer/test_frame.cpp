// Tests the renderer as a whole: invariants of its results for all scenes.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <set>

#include "engine/core/statistics.h"
#include "renderer/frame.h"
#include "shaders/shared/path_state.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/pass/stage.h"
#include "tests/support/error_message.h"
#include "tests/support/image_tests.h"

namespace halflight::test {
namespace {

using FrameTest = PassTest;

TEST_F(FrameTest, FurtherLayersDoNotChangeThePicture) {
    const Scene scene = shiny_cornell();
    const RenderResult all = render(context, scene, all_settings(scene, 45, 37, 5));
    RenderSettings settings = all_settings(scene, 45, 37, 5);
    settings.aovs.clear();
    settings.want_view = false;
    const RenderResult plain = render(context, scene, settings);
    EXPECT_TRUE(same_bits(plain.beauty, all.beauty));
    EXPECT_TRUE(plain.aovs.empty());
    EXPECT_TRUE(plain.view.pixels.empty());
    settings.measure = true;
    EXPECT_TRUE(same_bits(render(context, scene, settings).beauty, all.beauty));
}

TEST_F(FrameTest, NoUnwrittenMemoryIsRead) {
    // The sums must not change if undefined memory is poisoned, with or without memory shared by passes.
    const Scene scene = shiny_cornell();
    Stage stage(programs, scene, scene.cameras[0], {45, 37});
    gpu::Buffer bad_values("bad values", kBadValueCounts * sizeof(std::uint32_t));
    graph::Graph graph;
    const Frame frame = add_frame(graph, stage.view(graph), {4, true, true}, {bad_values});
    std::vector<std::vector<double>> first;
    for (const bool poison : {false, true}) {
        for (const bool alias : {true, false}) {
            executor.poison(poison);
            const graph::CompiledGraph plan = graph::compile(graph, {.alias = alias});
            for (std::uint32_t sample = 0; sample < 2; ++sample) {
                stage.select_sample(sample);
                executor.run(plan);
            }
            const Accumulated& a = frame.sums;
            std::vector<std::vector<double>> sums;
            for (const graph::BufferHandle h : {a.emission, a.direct, a.indirect, a.squares, a.features})
                sums.push_back(executor.read<double>(h));
            if (first.empty()) first = sums;
            EXPECT_EQ(sums, first) << "poison " << poison << ", alias " << alias;
        }
    }
    for (const std::uint32_t n : bad_values.read<std::uint32_t>()) EXPECT_EQ(n, 0u);
}

TEST_F(FrameTest, SeedsAndFramesAreOtherPictures) {
    const Scene scene = shiny_cornell();
    RenderSettings settings = small_settings(scene.cameras[0], 24, 24, 2, 2);
    std::vector<Image> pictures;
    for (const auto& [seed, frame] : {std::pair(0u, 0u), {1u, 0u}, {0u, 1u}, {1u, 1u}}) {
        settings.seed = seed, settings.frame = frame;
        pictures.push_back(render(context, scene, settings).beauty);
        for (std::size_t j = 0; j + 1 < pictures.size(); ++j) {
            int different = 0;
            for (std::size_t k = 0; k < pictures[j].pixels.size(); k += 4)
                different += pictures.back().pixels[k] != pictures[j].pixels[k];
            EXPECT_GT(different, 24 * 24 / 2) << seed << ", " << frame << " and picture " << j;
        }
    }
}

TEST_F(FrameTest, ComponentsSumToTheBeauty) {
    const Scene scene = shiny_cornell();
    const RenderResult r = render(context, scene, all_settings(scene, 45, 37, 9));
    for (std::size_t i = 0; i < 45 * 37; ++i) {
        for (std::size_t c = 0; c < 3; ++c) {
            double sum = 0;
            for (const char* name :
                 {"emission", "direct_diffuse", "direct_glossy", "indirect_diffuse", "indirect_glossy"})
                sum += layer(r, std::string(name) + ".R").pixels[3 * i + c];
            ASSERT_NEAR(r.beauty.pixels[4 * i + c], sum, 6 * 0x1p-24 * sum);
        }
    }
    for (const float n : layer(r, "samples.Y").pixels) EXPECT_EQ(n, 9);
    for (const BadValues& n : r.stats.bad_values) EXPECT_EQ(n.total(), 0u) << n.component;
    for (const ExrLayer& l : r.aovs) {
        if (l.channels[0] == "Z" || l.type == ExrType::uint32) continue;
        const NonFinite n = count_non_finite(l.image);
        EXPECT_EQ(n.nans + n.infinities, 0u) << l.channels[0];
    }
}

TEST_F(FrameTest, DirectLightIsTheSameForAnyNumberOfBounces) {
    const Scene scene = shiny_cornell();
    const RenderResult one = render(context, scene, small_settings(scene.cameras[0], 32, 32, 4, 1));
    const RenderResult six = render(context, scene, small_settings(scene.cameras[0], 32, 32, 4, 6));
    for (const char* name : {"emission.R", "direct_diffuse.R", "direct_glossy.R"})
        EXPECT_TRUE(same_bits(layer(one, name), layer(six, name))) << name;
    for (const float v : layer(one, "indirect_diffuse.R").pixels) EXPECT_EQ(v, 0);
    EXPECT_GT(mean_of_pixels(layer(six, "indirect_diffuse.R"), 0).value, 0.01);
}

TEST_F(FrameTest, VarianceIsOfTheMean) {
    // Compares the scatter of many independent pictures with the variance that each one estimates. The estimate assumes
    // independent samples. Stratified ones are better, and never worse.
    const Scene scene = shiny_cornell();
    RenderSettings settings = small_settings(scene.cameras[0], 24, 24, 4, 3);
    constexpr int kPictures = 32;
    std::vector<RunningMoments> pixels(24 * 24);
    RunningMoments claimed;
    for (std::uint32_t seed = 0; seed < kPictures; ++seed) {
        settings.seed = seed;
        const RenderResult r = render(context, scene, settings);
        for (std::size_t i = 0; i < pixels.size(); ++i) {
            pixels[i].add(r.beauty.pixels[4 * i]);
            claimed.add(layer(r, "variance.R").pixels[3 * i]);
        }
    }
    RunningMoments found;
    for (const RunningMoments& p : pixels) found.add(p.variance());
    EXPECT_LT(found.mean(), 1.1 * claimed.mean());
    EXPECT_GT(found.mean(), 0.3 * claimed.mean());
}

TEST_F(FrameTest, AlphaIsZeroWhereNoSurfaceIsSeen) {
    Scene scene = tilted_quad();
    const RenderSettings settings = small_settings(camera_on_quad(), 48, 32, 16, 1);
    const RenderResult clear = render(context, scene, settings);
    scene.environment.color = vec3(0.5f);
    const RenderResult sky = render(context, scene, settings);
    int none = 0, part = 0, whole = 0;
    for (int y = 0; y < 32; ++y) {
        for (int x = 0; x < 48; ++x) {
            const float a = clear.beauty.at(x, y)[3];
            EXPECT_EQ(a * 16, std::round(a * 16)) << "the share of samples that saw a surface";
            ++(a == 0 ? none : a == 1 ? whole : part);
            EXPECT_EQ(sky.beauty.at(x, y)[3], 1);
            if (a == 0) {
                EXPECT_EQ(sky.beauty.at(x, y)[0], 0.5f);
            }
        }
    }
    EXPECT_GT(none, 300);
    EXPECT_GT(whole, 200);
    EXPECT_GT(part, 30);
}

TEST_F(FrameTest, MotionIsRelativeToThePreviousFrame) {
    // An orthographic camera moves by a tenth of its view's height along both axes.
    Scene scene;
    add_quad(scene, add_material(scene, diffuse_material(vec3(0.5f))), {-2, 0, -2}, {0, 0, 4}, {4, 0, 0});
    const Camera camera = spot_camera(dvec3(0), {0, 1, 0}, 2);
    RenderSettings settings = small_settings(camera, 20, 20, 1, 0);
    settings.aovs = {"motion"};
    const RenderResult still = render(context, scene, settings);
    for (const float v : layer(still, "motion.X").pixels) EXPECT_NEAR(v, 0, 1e-3);
    settings.previous_camera = camera;
    settings.previous_camera->camera_to_world[3] += 0.2 * camera.camera_to_world[0] + 0.2 * camera.camera_to_world[1];
    const RenderResult r = render(context, scene, settings);
    const Image& motion = layer(r, "motion.X");
    for (int y = 0; y < 20; ++y) {
        for (int x = 0; x < 20; ++x) {
            // The camera moved left and down, so the scene moves right and up.
            EXPECT_NEAR(motion.at(x, y)[0], 2, 1e-3);
            EXPECT_NEAR(motion.at(x, y)[1], -2, 1e-3);
        }
    }
}

TEST_F(FrameTest, PassesThatContributeNothingAreLeftOut) {
    using Names = std::set<std::string>;
    const Names passes = {"shadow", "diffuse", "glossy", "continuation"};
    const auto expect_left_out = [&](const Scene& scene, int bounces, const Names& expected) {
        const RenderResult r = render(context, scene, small_settings(camera_on_quad(), 16, 16, 1, bounces));
        Names found;
        for (const LeftOut& part : r.stats.left_out)
            if (passes.contains(part.what)) found.insert(part.what);
        EXPECT_EQ(found, expected);
    };
    Scene scene = tilted_quad();
    expect_left_out(scene, 4, {"glossy"});
    expect_left_out(scene, 0, passes);
    scene.materials[0] = metal_material(vec3(1), 0.4f);
    expect_left_out(scene, 4, passes);  // there is no light
    scene.environment.color = vec3(1);
    expect_left_out(scene, 4, {"diffuse"});
    scene.materials[0].metallic = 0;
    expect_left_out(scene, 4, {});
    scene.materials[0] = light_material(vec3(1));
    expect_left_out(scene, 4, passes);  // nothing reflects light
}

TEST_F(FrameTest, TheGraphCanBeDumped) {
    const Scene scene = shiny_cornell();
    const std::string dot =
        Renderer(context, scene, ColorConfig::load(), small_settings(scene.cameras[0], 16, 16, 1, 2)).graph_dot();
    for (const char* pass : {"gbuffer: rasterize", "shadow: sample lights", "diffuse: sample", "glossy: sample",
                             "continuation: vertex", "accumulate"})
        EXPECT_NE(dot.find(pass), std::string::npos) << pass;
}

TEST_F(FrameTest, PicturesOfAnySize) {
    const Scene scene = shiny_cornell();
    for (const ivec2 size : {ivec2(1, 1), ivec2(1, 300), ivec2(300, 1), ivec2(17, 15), ivec2(16, 16)}) {
        const RenderResult r = render(context, scene, all_settings(scene, size.x, size.y, 1));
        EXPECT_EQ(ivec2(r.beauty.width, r.beauty.height), size);
        EXPECT_EQ(ivec2(r.view.width, r.view.height), size);
        const NonFinite n = count_non_finite(r.beauty);
        EXPECT_EQ(n.nans + n.infinities, 0u);
        for (const float v : layer(r, "variance.R").pixels) EXPECT_EQ(v, 0) << "a single sample has no variance";
        EXPECT_EQ(r.stats.paths, std::uint64_t(size.x) * std::uint64_t(size.y));
    }
}

TEST_F(FrameTest, VarianceBeyondFloatsStaysFinite) {
    Scene scene = shiny_cornell();
    for (Material& material : scene.materials) material.emission *= 1e24f;
    const RenderResult r = render(context, scene, all_settings(scene, 20, 20, 4));
    float most = 0;
    for (const float v : layer(r, "variance.R").pixels) {
        EXPECT_TRUE(std::isfinite(v));
        most = std::max(most, v);
    }
    EXPECT_EQ(most, std::numeric_limits<float>::max());
}

TEST_F(FrameTest, EmptyScene) {
    Scene scene;
    scene.cameras = {look_at_camera({0, 0, 1}, {0, 0, 0}, {0, 1, 0}, 1)};
    const RenderResult black = render(context, scene, all_settings(scene, 20, 20, 2));
    for (const float v : black.beauty.pixels) EXPECT_EQ(v, 0);
    scene.environment.color = {0.25f, 0.5f, 1};
    const RenderResult sky = render(context, scene, all_settings(scene, 20, 20, 2));
    for (std::size_t i = 0; i < sky.beauty.pixels.size(); ++i)
        EXPECT_EQ(sky.beauty.pixels[i], (std::array{0.25f, 0.5f, 1.0f, 1.0f}[i % 4]));
    for (const float z : layer(sky, "Z").pixels) EXPECT_EQ(z, 1e10f);
}

TEST_F(FrameTest, BandsJoinWithoutASeam) {
    // Textures here have at most 16384 rows, so the third band is incomplete. One sun lights one floor, so all pixels
    // have equal radiance. The camera looks straight down, so z determines the row.
    Scene scene = floor_scene(diffuse_material(vec3(0.5f)));
    PunctualLight& sun = scene.lights.emplace_back();
    sun.type = LightType::directional;
    sun.direction = {0, -1, 0};
    sun.intensity = {1, 2, 3};
    const int width = 3, height = 32768 + 40;
    RenderSettings settings = small_settings(spot_camera(dvec3(0), {0, 1, 0}, 1900), width, height, 1, 1);
    settings.aovs = {"position"};
    const RenderResult r = render(context, scene, settings);
    const Image& position = layer(r, "position.X");
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            for (int c = 0; c < 3; ++c)
                ASSERT_NEAR(r.beauty.at(x, y)[c], 0.5 / kPi * sun.intensity[c], 1e-6) << x << ", " << y;
            // The camera's up direction is -z.
            const double row = ((y + 0.5) / height - 0.5) * 1900;
            ASSERT_NEAR(position.at(x, y)[2], row, 1e-3) << x << ", " << y;
        }
    }
}

TEST_F(FrameTest, ProgressReportsEverySampleAndCanStop) {
    const Scene scene = shiny_cornell();
    Renderer renderer(context, scene, ColorConfig::load(), small_settings(scene.cameras[0], 16, 16, 6, 1));
    const RenderResult whole = renderer.render([](const RenderProgress& p) {
        EXPECT_EQ(p.samples_total, 6);
        return true;
    });
    EXPECT_EQ(whole.stats.samples, 6);
    EXPECT_FALSE(whole.stats.interrupted);

    const RenderResult stopped = renderer.render([](const RenderProgress& p) { return p.samples_done < 2; });
    EXPECT_EQ(stopped.stats.samples, 2);
    EXPECT_TRUE(stopped.stats.interrupted);
    EXPECT_TRUE(
        same_bits(stopped.beauty, render(context, scene, small_settings(scene.cameras[0], 16, 16, 2, 1)).beauty))
        << "the samples so far equal a render with fewer samples";

    RenderSettings settings = small_settings(scene.cameras[0], 16, 16, 1 << 20, 1);
    settings.time_limit = 0.2;
    const RenderResult timed = render(context, scene, settings);
    EXPECT_GE(timed.stats.samples, 1);
    EXPECT_LT(timed.stats.samples, 1 << 20);
    EXPECT_FALSE(timed.stats.interrupted);
}

TEST_F(FrameTest, SettingsOutOfRangeAreErrors) {
    const Scene scene = shiny_cornell();
    const RenderSettings good = small_settings(scene.cameras[0], 16, 16, 1, 1);
    const auto message = [&](auto&& change) {
        RenderSettings s = good;
        change(s);
        return error_message([&] { render(context, scene, s); });
    };
    EXPECT_EQ(message([](RenderSettings&) {}), "");
    const std::pair<std::string, std::function<void(RenderSettings&)>> rows[] = {
        {"width", [](RenderSettings& s) { s.width = 0; }},
        {"height", [](RenderSettings& s) { s.height = 70000; }},
        {"samples", [](RenderSettings& s) { s.samples = 0; }},
        {"bounces", [](RenderSettings& s) { s.bounces = -1; }},
        {"time", [](RenderSettings& s) { s.time_limit = NAN; }},
        {"65536", [](RenderSettings& s) { s.width = 65536; }},  // more than the driver allows
        {"depht", [](RenderSettings& s) { s.aovs = {"depht"}; }},
        {"all", [](RenderSettings& s) { s.aovs = {"all"}; }},
    };
    for (const auto& [name, change] : rows) EXPECT_NE(message(change).find(name), std::string::npos) << name;
}

TEST_F(FrameTest, StatisticsArePlausible) {
    const Scene scene = shiny_cornell();
    RenderSettings settings = small_settings(scene.cameras[0], 32, 32, 3, 3);
    settings.measure = true;
    const RenderStats stats = render(context, scene, settings).stats;
    EXPECT_EQ(stats.paths, 32u * 32 * 3);
    EXPECT_GT(stats.gpu_bytes, 10000u);
    EXPECT_GT(stats.render_seconds, 0);
    EXPECT_GT(stats.prepare_seconds, 0);
    const auto found = std::ranges::find(stats.passes, "accumulate", &PassTime::name);
    ASSERT_NE(found, stats.passes.end());
    EXPECT_EQ(found->runs, 3u);
    EXPECT_GT(found->seconds, 0);
    ASSERT_EQ(stats.bad_values.size(), shared::kCountedPasses);
}

}  // namespace
}  // namespace halflight::test
