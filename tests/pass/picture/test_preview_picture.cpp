// Tests preview modes through the renderer: less noise while the camera moves, and the mean when it stops.
#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

#include "engine/core/error.h"
#include "engine/core/metrics.h"
#include "engine/io/gltf/gltf.h"
#include "renderer/preview_picture.h"
#include "shaders/shared/preview.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/error_message.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

constexpr Preview kBoth{.temporal = true, .filter = true};

class PreviewPictureTest : public GpuTest {
  protected:
    Renderer renderer(PreparedScene& prepared, RenderSettings settings, const Preview& preview) {
        settings.preview = preview;
        return {prepared, colors, settings};
    }
    ColorConfig colors = ColorConfig::load();
};

Camera moved(Camera camera, double way) {
    camera.camera_to_world[3] += way * camera.camera_to_world[0];
    return camera;
}

double relative_error(const Image& image, const Image& reference) {
    return mean_of(relative_squared_error_map(image, reference));
}

TEST_F(PreviewPictureTest, AStaticCameraConvergesToTheMean) {
    const Scene scene = shiny_cornell();
    PreparedScene prepared(context, scene);
    const RenderSettings settings = small_settings(scene.cameras[0], 40, 30, 1, 3);
    Renderer plain = renderer(prepared, settings, {}), temporal = renderer(prepared, settings, {.temporal = true}),
             both = renderer(prepared, settings, kBoth);
    PictureHistory of_temporal, of_both;
    const auto render = [&](Renderer& by, PictureHistory* history, const Camera& camera, int samples) {
        FrameSettings frame = settings;
        frame.camera = camera, frame.samples = samples, frame.history = history;
        return by.render(frame);
    };
    const Camera first = settings.camera, second = moved(first, 0.05);
    const RenderResult begun = render(temporal, &of_temporal, first, 1);
    EXPECT_TRUE(same_bits(begun.beauty, render(plain, nullptr, first, 1).beauty)) << "there is no earlier picture";
    EXPECT_TRUE(begun.stats.biases.empty());
    render(both, &of_both, first, 1);

    const RenderResult early = render(plain, nullptr, second, 16);
    const RenderResult early_temporal = render(temporal, &of_temporal, second, 16);
    EXPECT_FALSE(same_bits(early_temporal.beauty, early.beauty));
    ASSERT_EQ(early_temporal.stats.biases.size(), 1u);
    EXPECT_EQ(early_temporal.stats.biases[0],
              "preview: light of earlier pictures is reused until there are 32 samples");
    const RenderResult early_both = render(both, &of_both, second, 16);
    ASSERT_EQ(early_both.stats.biases.size(), 2u);
    EXPECT_TRUE(early_both.stats.layer_biases.empty());
    EXPECT_EQ(early_both.stats.biases[1], "preview: noise is filtered out until there are 256 samples");
    EXPECT_TRUE(same_bits(layer(early_both, "direct_diffuse.R"), layer(early, "direct_diffuse.R"))) << "a layer";

    const auto ends = static_cast<int>(shared::kTemporalEnds);
    const RenderResult late = render(temporal, &of_temporal, second, ends);
    EXPECT_TRUE(same_bits(late.beauty, render(plain, nullptr, second, ends).beauty));
    EXPECT_TRUE(late.stats.biases.empty());
    const auto all_end = static_cast<int>(shared::kFilterEnds);
    FrameSettings frame = settings;
    frame.camera = second, frame.samples = all_end, frame.history = &of_both;
    std::vector<std::size_t> biases;
    const RenderResult last = both.render(frame, [&](const RenderProgress& progress) {
        if (progress.samples_done % 31 == 0) biases.push_back(progress.picture({}).stats.biases.size());
        return true;
    });
    EXPECT_EQ(biases, (std::vector<std::size_t>{2, 1, 1, 1, 1, 1, 1, 1}));
    EXPECT_TRUE(same_bits(last.beauty, render(plain, nullptr, second, all_end).beauty));
    EXPECT_TRUE(last.stats.biases.empty());
}

TEST_F(PreviewPictureTest, FiltersPicturesOfTheRadianceCache) {
    const Scene scene = shiny_cornell();
    PreparedScene prepared(context, scene);
    RenderSettings settings = small_settings(scene.cameras[0], 40, 30, 1, 3);
    const auto render = [&](const Preview& preview, int samples) {
        settings.samples = samples;
        return renderer(prepared, settings, preview).render();
    };
    const Preview filter{.filter = true}, cache{.cache = true}, both{.cache = true, .filter = true};
    for (const int samples : {1, 6}) {  // 1: cached samples only; 6: cached and unbiased samples
        const RenderResult filtered = render(both, samples);
        EXPECT_EQ(filtered.stats.biases.size(), 2u);
        EXPECT_FALSE(same_bits(filtered.beauty, render(filter, samples).beauty));
        const RenderResult found = render(cache, samples);
        EXPECT_EQ(found.stats.biases.size(), 1u);
        EXPECT_FALSE(same_bits(filtered.beauty, found.beauty));
        EXPECT_TRUE(same_bits(layer(filtered, "indirect_diffuse.R"), layer(found, "indirect_diffuse.R")));
    }
    // The first 4 of the 32 samples have faded out.
    EXPECT_TRUE(same_bits(render(both, 32).beauty, render(filter, 28).beauty));
}

TEST_F(PreviewPictureTest, TheFilterLowersTheErrorAndKeepsTheLight) {
    const Scene scene = shiny_cornell();
    PreparedScene prepared(context, scene);
    const RenderSettings settings = small_settings(scene.cameras[0], 64, 48, 1, 3);
    const auto render = [&](const Preview& preview, int samples, std::uint32_t seed) {
        RenderSettings s = settings;
        s.samples = samples, s.seed = seed;
        return rgb(renderer(prepared, s, preview).render().beauty);
    };
    const Image reference = render({}, 512, 5);
    for (const auto& [samples, most] : {std::pair(1, 0.5), std::pair(2, 0.4), std::pair(8, 0.4)}) {
        const Image noisy = render({}, samples, 0), filtered = render({.filter = true}, samples, 0);
        EXPECT_LT(relative_error(filtered, reference), most * relative_error(noisy, reference)) << samples;
        EXPECT_NEAR(mean_of(filtered) / mean_of(noisy), 1, 0.03) << samples;
    }
}

TEST_F(PreviewPictureTest, ReusesThePreviousPictureAndNotItself) {
    const Scene scene = shiny_cornell();
    PreparedScene prepared(context, scene);
    const RenderSettings settings = small_settings(scene.cameras[0], 40, 30, 1, 3);
    const auto second_picture = [&](int looks) {
        Renderer r = renderer(prepared, settings, kBoth);
        PictureHistory history;
        FrameSettings frame = settings;
        frame.history = &history;
        r.render(frame);
        frame.camera = moved(frame.camera, 0.05), frame.seed = 1, frame.samples = 4;
        return r.render(frame, [&](const RenderProgress& progress) {
            for (int i = 0; i < looks; ++i) progress.picture({});
            return true;
        });
    };
    EXPECT_TRUE(same_bits(second_picture(0).beauty, second_picture(2).beauty)) << "displaying it changes it";
}

TEST_F(PreviewPictureTest, RestartsAtAnotherSize) {
    const Scene scene = shiny_cornell();
    PreparedScene prepared(context, scene);
    RenderSettings settings = small_settings(scene.cameras[0], 40, 30, 1, 3);
    Renderer fine = renderer(prepared, settings, {.temporal = true});
    const Image plain = renderer(prepared, settings, {}).render().beauty;
    settings.width /= 4, settings.height = 8;
    Renderer coarse = renderer(prepared, settings, {.temporal = true});
    PictureHistory history;
    FrameSettings frame = settings;
    frame.history = &history;
    coarse.render(frame);
    const RenderResult after_coarse = fine.render(frame);
    EXPECT_FALSE(same_bits(after_coarse.beauty, plain));
    history.forget();
    const RenderResult forgotten = fine.render(frame);
    EXPECT_TRUE(same_bits(forgotten.beauty, plain));
    EXPECT_TRUE(forgotten.stats.biases.empty());
}

TEST_F(PreviewPictureTest, IsEqualInBandsAndInTurns) {
    const Scene scene = shiny_cornell();
    PreparedScene prepared(context, scene);
    RenderSettings settings = small_settings(scene.cameras[0], 45, 60, 2, 3);
    settings.want_view = true;
    const auto second_picture = [&] {
        Renderer r = renderer(prepared, settings, kBoth);
        PictureHistory history;
        FrameSettings frame = settings;
        frame.history = &history;
        r.render(frame);
        frame.camera = moved(frame.camera, 0.05), frame.seed = 1;
        return r.render(frame);
    };
    const RenderResult whole = second_picture();
    settings.band_pixels = 48 * 16;
    expect_same(second_picture(), whole);
    settings.in_turns = true;
    expect_same(second_picture(), whole);
    EXPECT_TRUE(same_bits(whole.view, colors.view({}).apply(whole.beauty))) << "the view is another picture's";
}

TEST_F(PreviewPictureTest, ErrorTargetsAreRefused) {
    const Scene scene = shiny_cornell();
    RenderSettings settings = small_settings(scene.cameras[0], 16, 16, 64, 1);
    settings.preview.filter = true;
    settings.error = ErrorTarget{};
    EXPECT_EQ(error_message([&] { render(context, scene, settings); }),
              "render settings: an error target cannot be combined with a preview mode");
}

/// Renders an orbit of one-sample frames without a stop, and measures the errors of the last frame.
class OrbitTest : public PreviewPictureTest {
  protected:
    struct Errors {
        double off = 0, temporal = 0, both = 0;
        double light = 0;  // mean of the picture with both modes, relative to the reference
    };
    Errors errors_of(const std::string& file) {
        constexpr int kFrames = 12;
        constexpr ivec2 kSize(128, 72);
        const Scene scene = load_gltf(std::string(HALFLIGHT_SOURCE_DIR) + "/scenes/" + file);
        PreparedScene prepared(context, scene);
        RenderSettings settings;
        settings.width = kSize.x, settings.height = kSize.y;
        settings.camera = scene.cameras[0];
        settings.bounces = 4;
        const auto camera_of = [&](int frame) {
            Camera camera = settings.camera;
            camera.camera_to_world = camera.camera_to_world * glm::rotate(dmat4(1), 0.01 * frame, dvec3(0, 1, 0));
            return moved(camera, 0.02 * frame);
        };
        FrameSettings last = settings;
        last.camera = camera_of(kFrames - 1), last.samples = 384, last.seed = 99;
        const Image reference = renderer(prepared, settings, {}).render(last).beauty;
        const auto render = [&](const Preview& preview) {
            Renderer r = renderer(prepared, settings, preview);
            PictureHistory history;
            RenderResult result;
            for (int i = 0; i < kFrames; ++i) {
                FrameSettings frame = settings;
                frame.camera = camera_of(i), frame.samples = 1, frame.history = &history;
                frame.frame = static_cast<std::uint32_t>(i);
                result = r.render(frame);
            }
            EXPECT_EQ(result.stats.biases.size(), std::size_t(preview.temporal) + std::size_t(preview.filter));
            return result.beauty;
        };
        const auto error = [&](const Image& image) { return relative_error(image, reference); };
        const Image both = render(kBoth);
        const Errors e{error(render({})), error(render({.temporal = true})), error(both),
                       mean_of(rgb(both)) / mean_of(rgb(reference))};
        RecordProperty("errors", fmt::format("{:.4g} {:.4g} {:.4g}, light {:.4g}", e.off, e.temporal, e.both, e.light));
        return e;
    }
};

TEST_F(OrbitTest, ErrorsAreLowerInTheRoom) {
    const Errors e = errors_of("room.glb");
    EXPECT_LT(e.temporal, e.off / 20);
    EXPECT_LT(e.both, e.off / 80);
    EXPECT_NEAR(e.light, 1, 0.1) << "only clipped outliers lose light";
}

TEST_F(OrbitTest, ErrorsAreLowerInTheAtrium) {
    const Errors e = errors_of("atrium.glb");
    EXPECT_LT(e.temporal, e.off / 3);
    EXPECT_LT(e.both, e.off / 6);
    EXPECT_NEAR(e.light, 1, 0.1);
}

}  // namespace
}  // namespace halflight::test
