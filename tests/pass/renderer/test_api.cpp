// Tests features of the library interface alone: callers' ray servers, and renderers that share scenes and contexts.
#include <gtest/gtest.h>

#include <set>

#include "api/halflight/ray_server.h"
#include "api/sequence/fingerprint.h"
#include "engine/core/interruption.h"
#include "engine/core/key_text.h"
#include "engine/io/files.h"
#include "engine/rays/rays.h"
#include "tests/cli/animated_scenes.h"
#include "tests/pass/renders.h"
#include "tests/support/gpu_test.h"
#include "tests/support/process.h"
#include "tests/unit/io/gltf_builder.h"
#include "tools/common/temporary_folder.h"

namespace halflight::test {
namespace {

/// Serves batches by the plain tracer, and counts them.
class CountingServer final : public rays::BatchServer {
  public:
    graph::BufferHandle add(graph::Graph& graph, const rays::TraceScene& scene, const rays::RayBatch& batch,
                            graph::BufferHandle results, bool any_hit) override {
        ++batches;
        return any_hit ? rays::any_hit(graph, scene, batch, results) : rays::closest_hit(graph, scene, batch, results);
    }
    int batches = 0;
};

class ApiTest : public testing::Test {
  protected:
    static LoadedScene cornell() { return LoadedScene({.scene = HALFLIGHT_SOURCE_DIR "/scenes/cornell.glb"}); }
    RenderSettings settings() const {
        RenderSettings s;
        s.width = 24, s.height = 16, s.samples = 2;
        s.aovs = {"albedo"};
        return s;
    }
    RendererOptions options() const {
        RendererOptions o;
        o.context = context;
        return o;
    }

    std::shared_ptr<gpu::Context> context = std::make_shared<gpu::Context>(test_context());
};

TEST_F(ApiTest, RayServersOfCallersServeAllBatches) {
    LoadedScene scene = cornell();
    RenderSettings plain = settings();
    plain.culling = rays::Culling::off;
    const RenderResult expected = FrameRenderer(scene, plain, options()).render();

    const auto server = std::make_shared<CountingServer>();
    RendererOptions served = options();
    served.ray_server = [&](const rays::TraceScene&) { return server; };
    const RenderResult result = FrameRenderer(scene, settings(), served).render();
    EXPECT_TRUE(same_bits(result.beauty, expected.beauty));
    EXPECT_GT(server->batches, 2);
    for (const rays::BatchStatistics& batch : result.stats.batches) EXPECT_STREQ(name(batch.method), "other");
}

TEST_F(ApiTest, InterruptedRenderersKeepThePreparedScene) {
    struct Ended {};
    LoadedScene scene = cornell();
    int prepared = 0;
    RendererOptions counting = options();
    counting.ray_server = [&](const rays::TraceScene&) {
        ++prepared;
        return std::make_shared<CountingServer>();
    };
    FrameRenderer renderer(scene, settings(), counting);
    const Image expected = renderer.render().beauty;
    for (const int last : {1, 2, 5}) {
        int points = 0;
        const Interruptible ends([&] {
            if (++points == last) throw Ended();
        });
        EXPECT_THROW(renderer.render(), Ended);
    }
    EXPECT_TRUE(same_bits(renderer.render().beauty, expected));
    EXPECT_EQ(prepared, 1);
    EXPECT_THROW(renderer.render([](const RenderProgress&) -> bool { throw Ended(); }), Ended);
    EXPECT_TRUE(same_bits(renderer.render().beauty, expected));
    EXPECT_EQ(prepared, 2) << "other exceptions leave the state undefined";
}

TEST_F(ApiTest, RenderersShareScenesAndEditsHold) {
    LoadedScene scene = cornell();
    FrameRenderer one(scene, settings(), options()), other(scene, settings());  // `one` has a context of its own
    const Image before = one.render().beauty;
    EXPECT_TRUE(same_bits(other.render().beauty, before));

    SceneEdits edits;
    edits.emission = 2;
    edits.transforms[0] = scene.scene().instances[0].object_to_world;
    edits.transforms[0][3].y += 0.25;
    scene.edit(edits);
    const Image edited = one.render().beauty;
    EXPECT_FALSE(same_bits(edited, before));
    EXPECT_TRUE(same_bits(other.render().beauty, edited));
    EXPECT_TRUE(same_bits(FrameRenderer(scene, settings(), options()).render().beauty, edited));

    SceneEdits wrong = edits;
    wrong.transforms[1000] = dmat4(1);
    EXPECT_THROW(scene.edit(wrong), Error);
    EXPECT_EQ(scene.edits(), edits);
    scene.edit({});
    EXPECT_TRUE(same_bits(one.render().beauty, before));
    EXPECT_TRUE(same_bits(other.render().beauty, before));
}

/// Settings that are left to the scene follow its edits and its camera.
TEST_F(ApiTest, RenderersFollowGlassAndLenses) {
    LoadedScene scene = cornell();
    FrameRenderer renderer(scene, settings(), options());
    renderer.render();
    SceneEdits edits;
    edits.materials = {{.name = "white", .edit = {{"transmission", {1}}, {"thickness", {0.1f}}}}};
    scene.edit(edits);
    const Image glass = renderer.render().beauty;
    EXPECT_TRUE(same_bits(glass, FrameRenderer(scene, settings(), options()).render().beauty));
    EXPECT_EQ(renderer.settings().bounces, kBouncesOfSolids);
    scene.edit({});
    renderer.render();
    EXPECT_EQ(renderer.settings().bounces, kBounces);

    const TemporaryFolder folder;
    GltfBuilder b;
    b.add_triangle();
    for (const char* name : {"blurred", "sharp"}) {
        b.push("cameras", {{"type", "perspective"}, {"name", name}, {"perspective", {{"yfov", 1}, {"znear", 0.1}}}});
        b.push("nodes", {{"camera", b.json["cameras"].size() - 1}, {"translation", {0.3, 0.3, 2}}});
    }
    b.json["cameras"][0]["extras"] = {{"aperture_fstop", 0.2}, {"focus_distance", 1}};
    write_text(folder / "lenses.glb", b.glb());
    LoadedScene lenses({.scene = folder / "lenses.glb"}, {.camera = "blurred"});
    FrameRenderer both(lenses, settings(), options());
    const Image blurred = both.render().beauty;
    lenses.set_camera({.camera = "sharp"});
    const Image sharp = both.render().beauty;
    EXPECT_FALSE(same_bits(sharp, blurred));
    EXPECT_TRUE(same_bits(sharp, FrameRenderer(lenses, settings(), options()).render().beauty));
}

/// A default camera frames the scene at 0 s, whatever frame was rendered last.
TEST_F(ApiTest, DefaultCamerasDoNotDependOnTheLastFrame) {
    const TemporaryFolder folder;
    GltfBuilder b;
    b.add_triangle();
    const Json sampler = {{"input", b.floats("SCALAR", {0, 1})}, {"output", b.floats("VEC3", {0, 0, 0, 9, 0, 0})}};
    const Json target = {{"node", 0}, {"path", "translation"}};
    b.push("animations", {{"channels", {{{"sampler", 0}, {"target", target}}}}, {"samplers", {sampler}}});
    write_text(folder / "slide.glb", b.glb());
    LoadedScene scene({.scene = folder / "slide.glb", .animation = "all"});
    FrameRenderer renderer(scene, settings(), options());
    const Image first = renderer.render(0).beauty;
    renderer.render(20);
    scene.set_camera({});
    EXPECT_TRUE(same_bits(renderer.render(0).beauty, first));
}

/// The history of preview mode `temporal` ends with edits, since it holds light of other lights and materials.
TEST_F(ApiTest, EditsEndTheHistoryOfPreviews) {
    LoadedScene scene = cornell();
    RenderSettings preview = settings();
    preview.preview.temporal = true;
    FrameRenderer renderer(scene, preview, options());
    const Image first = renderer.render().beauty;
    EXPECT_FALSE(same_bits(renderer.render().beauty, first)) << "there is no history";
    SceneEdits edits;
    edits.emission = 2;
    scene.edit(edits);
    const Image edited = renderer.render().beauty;
    EXPECT_TRUE(same_bits(edited, FrameRenderer(scene, preview, options()).render().beauty));
}

/// A stopped picture is one of its own frame, with the samples so far.
TEST_F(ApiTest, StoppedPicturesAreOfTheirFrame) {
    const TemporaryFolder folder;
    LoadedScene scene({.scene = write_animated_scene(folder.path), .animation = "all"}, {.camera = "moving"});
    constexpr std::uint32_t kFrame = 12;
    RenderSettings denoised = settings();
    denoised.aovs = {"albedo", "noisy"};
    denoised.denoise = true;
    denoised.denoise_frames = 1;
    const RenderResult whole = FrameRenderer(scene, denoised, options()).render(kFrame);
    const int all = denoised.samples;
    const auto in_a_neighbour = [&](const RenderProgress& p) { return p.samples_done <= all; };
    const RenderResult stopped = FrameRenderer(scene, denoised, options()).render(kFrame, in_a_neighbour);
    EXPECT_FALSE(whole.stats.interrupted);
    EXPECT_TRUE(stopped.stats.interrupted);
    EXPECT_EQ(stopped.stats.samples, all);
    for (std::size_t layer = 0; layer < 2; ++layer)
        EXPECT_TRUE(same_bits(stopped.aovs[layer].image, whole.aovs[layer].image)) << stopped.aovs[layer].name;
    EXPECT_FALSE(same_bits(stopped.beauty, stopped.aovs[1].image)) << "it is not denoised";

    // Without motion, a picture of some times is a picture of that many samples.
    LoadedScene still = cornell();
    RenderSettings blurred = settings();
    blurred.samples = 6, blurred.want_view = true;
    RendererOptions shutter = options();
    shutter.shutter = {.open = 0.5};
    const auto after = [](int samples) {
        return [samples](const RenderProgress& p) { return p.samples_done < samples; };
    };
    const RenderResult four = FrameRenderer(still, blurred, options()).render(0, after(4));
    const RenderResult part = FrameRenderer(still, blurred, shutter).render(0, after(4));
    EXPECT_TRUE(part.stats.interrupted);
    EXPECT_EQ(part.stats.samples, 4);
    EXPECT_FALSE(part.view.pixels.empty());
    EXPECT_TRUE(same_bits(part.beauty, four.beauty));
}

TEST_F(ApiTest, FilesThatChangeAfterTheyWereLoadedHaveNoFingerprint) {
    const TemporaryFolder folder;
    const auto copy = [&](const char* source, const char* name) {
        std::filesystem::copy_file(std::filesystem::path(HALFLIGHT_SOURCE_DIR) / source, folder / name);
    };
    copy("scenes/cornell.glb", "scene.glb");
    write_text(folder / "map.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n" + std::string(8, '\x80'));
    write_text(folder / "config.ocio", R"(ocio_profile_version: 2
environment: {}
roles: {default: lin_rec709}
file_rules: [!<Rule> {name: Default, colorspace: default}]
displays: {screen: [!<View> {name: raw, colorspace: lin_rec709}, !<View> {name: graded, colorspace: grade}]}
colorspaces:
  - !<ColorSpace> {name: lin_rec709}
  - !<ColorSpace> {name: grade, from_scene_reference: !<FileTransform> {src: lut.spi1d}}
)");
    write_text(folder / "lut.spi1d", "Version 1\nFrom 0 1\nLength 2\nComponents 1\n{\n0\n1\n}\n");
    for (const char* name : {"scene.glb", "map.hdr", "config.ocio", "lut.spi1d"}) {
        LoadedScene scene({.scene = folder / "scene.glb", .environment = std::filesystem::path(folder / "map.hdr")});
        const ColorConfig config = ColorConfig::load(folder / "config.ocio");
        RenderSettings s = settings();
        s.want_view = true;
        s.view.view = "graded";
        const auto print = [&] { return sequence_prints(sums_fingerprint(scene, s, {}), s, config, {}, {1}).view; };
        const std::string before = print();
        EXPECT_EQ(print(), before);
        const std::string text = read_text(folder / name);
        write_file(folder / name, text);  // another file with the same bytes may have had others in between
        EXPECT_EQ(error_message(print), std::string(folder / name) + ": has changed since it was loaded");
    }
}

TEST_F(ApiTest, EachEditHasAFingerprintOfItsOwn) {
    LoadedScene scene = cornell();
    const std::string mesh = "mesh:" + scene.scene().meshes[0].name, material = scene.scene().materials[0].name;
    const std::vector<std::pair<std::string, SceneEdits>> all = {
        {"", {}},
        {"env-rotation", {.environment_rotation = 90}},
        {"env-intensity", {.environment_intensity = 2}},
        {"env-tint", {.environment_tint = vec3(1, 0.5f, 0.5f)}},
        {"emission", {.emission = 2}},
        {"lamp-radius", {.lamp_radius = 2.0f}},
        {"sun-angle", {.sun_angle = 2.0f}},
        {"glass-shadows", {.straight_glass = true}},
        {"clay", {.clay = true}},
        {"instances", {.transforms = {{0, dmat4(1)}}}},
        {"materials", {.materials = {{material, {{"metallic", {1}}}}}}},
        {"hidden", {.hidden = {{mesh}}}},
        {"catchers", {.catchers = {{mesh}}}},
        {"ground", {.ground = true}},
        {"ground", {.ground = true, .ground_height = 2.0}},
        {"groups", {.each_light = true}}};
    const std::string plain = sums_fingerprint(scene, settings(), {});
    std::set<std::string> prints;
    for (const auto& [key, edits] : all) {
        scene.edit(edits);
        const std::string print = sums_fingerprint(scene, settings(), {});
        EXPECT_TRUE(prints.insert(print).second) << key;
        EXPECT_TRUE(key.empty() || differences(print, plain).find(key) != std::string::npos)
            << differences(print, plain);
    }
    scene.edit({});
    EXPECT_EQ(sums_fingerprint(scene, settings(), {}), plain);
}

TEST_F(ApiTest, FreedScenesGoOnWithTheirRendererAlone) {
    LoadedScene scene = cornell();
    const RenderResult expected = FrameRenderer(scene, settings(), options()).render();
    RendererOptions frees = options();
    frees.frees_scene = true;
    FrameRenderer renderer(scene, settings(), frees);
    EXPECT_TRUE(same_bits(renderer.render().beauty, expected.beauty));
    EXPECT_TRUE(scene.scene().meshes[0].positions.empty());
    EXPECT_TRUE(same_bits(renderer.render().beauty, expected.beauty));
    FrameRenderer late(scene, settings(), options());
    EXPECT_THROW(late.render(), Error);
    SceneEdits edits;
    edits.emission = 2;
    scene.edit(edits);
    EXPECT_THROW(renderer.render(), Error);
}

TEST_F(ApiTest, OpenEstimatorsAreRefusedUntilTheyAreFound) {
    LoadedScene scene = cornell();
    RenderSettings open = settings();
    open.estimator.camera = CameraRays::automatic;
    FrameRenderer renderer(scene, open, options());
    EXPECT_THROW(renderer.render(), Error);
    EXPECT_FALSE(renderer.find_estimator([](double) { return false; }));
    const std::optional<Estimator> found = renderer.find_estimator();
    ASSERT_TRUE(found);
    EXPECT_FALSE(leaves_open(*found));
    EXPECT_EQ(renderer.render().stats.estimator.camera, found->camera);
}

}  // namespace
}  // namespace halflight::test
