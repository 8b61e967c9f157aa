// Tests preview modes through the renderer: less noise while the camera moves, and the mean when it stops.
#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

#include "engine/io/gltf/gltf.h"
#include "renderer/preview_picture.h"
#include "shaders/shared/preview_constants.h"
#include "tests/pass/picture/cornell_test.h"

namespace halflight::test {
namespace {

constexpr Preview kBoth{.temporal = true, .filter = true};

class PreviewPictureTest : public CornellTest {
  protected:
    Renderer renderer(PreparedScene& prepared, RenderSettings settings, const Preview& preview) {
        settings.preview = preview;
        return {prepared, colors, settings};
    }
    static Camera moved(Camera camera, double way) {
        camera.camera_to_world[3] += way * camera.camera_to_world[0];
        return camera;
    }
    /// Returns the picture of a camera that has moved, after one before. It is looked at `looks` times per sample.
    RenderResult second_picture(PreparedScene& prepared, const RenderSettings& settings, int samples, int looks = 0) {
        Renderer r = renderer(prepared, settings, kBoth);
        PictureHistory history;
        FrameSettings frame = settings;
        r.render(frame, {.history = &history});
        frame.camera = moved(frame.camera, 0.05), frame.seed = 1, frame.samples = samples;
        return r.render(frame, {.history = &history}, [&](const RenderProgress& progress) {
            for (int i = 0; i < looks; ++i) progress.picture({});
            return true;
        });
    }
};

TEST_F(PreviewPictureTest, AStaticCameraConvergesToTheMean) {
    const RenderSettings settings = small_settings(cornell.cameras[0], 40, 30, 1, 3);
    Renderer plain = renderer(prepared_cornell, settings, {}),
             temporal = renderer(prepared_cornell, settings, {.temporal = true}),
             both = renderer(prepared_cornell, settings, kBoth);
    PictureHistory of_temporal, of_both;
    const auto render = [&](Renderer& by, PictureHistory* history, const Camera& camera, int samples) {
        FrameSettings frame = settings;
        frame.camera = camera, frame.samples = samples;
        return by.render(frame, {.history = history});
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
    const RenderResult early_both = render(both, &of_both, second, 16);
    ASSERT_EQ(early_both.stats.biases.size(), 2u);
    EXPECT_TRUE(early_both.stats.layer_biases.empty());
    EXPECT_TRUE(same_bits(layer(early_both, "direct_diffuse.R"), layer(early, "direct_diffuse.R"))) << "a layer";

    const auto ends = static_cast<int>(shared::kTemporalEnds);
    const RenderResult late = render(temporal, &of_temporal, second, ends);
    EXPECT_TRUE(same_bits(late.beauty, render(plain, nullptr, second, ends).beauty));
    EXPECT_TRUE(late.stats.biases.empty());
    const auto all_end = static_cast<int>(shared::kFilterEnds);
    FrameSettings frame = settings;
    frame.camera = second, frame.samples = all_end;
    std::vector<std::size_t> biases;
    const RenderResult last = both.render(frame, {.history = &of_both}, [&](const RenderProgress& progress) {
        if (progress.samples_done % 31 == 0) biases.push_back(progress.picture({}).stats.biases.size());
        return true;
    });
    EXPECT_EQ(biases, (std::vector<std::size_t>{2, 1, 1, 1, 1, 1, 1, 1}));
    EXPECT_TRUE(same_bits(last.beauty, render(plain, nullptr, second, all_end).beauty));
    EXPECT_TRUE(last.stats.biases.empty());
}

TEST_F(PreviewPictureTest, FiltersPicturesOfTheRadianceCache) {
    RenderSettings settings = small_settings(cornell.cameras[0], 40, 30, 1, 3);
    const auto render = [&](const Preview& preview, int samples) {
        settings.samples = samples;
        return renderer(prepared_cornell, settings, preview).render();
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

TEST_F(PreviewPictureTest, ReusesThePreviousPictureAndNotItself) {
    const RenderSettings settings = small_settings(cornell.cameras[0], 40, 30, 1, 3);
    EXPECT_TRUE(same_bits(second_picture(prepared_cornell, settings, 4).beauty,
                          second_picture(prepared_cornell, settings, 4, 2).beauty))
        << "displaying it changes it";
}

TEST_F(PreviewPictureTest, RestartsAtAnotherSize) {
    RenderSettings settings = small_settings(cornell.cameras[0], 40, 30, 1, 3);
    Renderer fine = renderer(prepared_cornell, settings, {.temporal = true});
    const Image plain = renderer(prepared_cornell, settings, {}).render().beauty;
    settings.width /= 4, settings.height = 8;
    Renderer coarse = renderer(prepared_cornell, settings, {.temporal = true});
    PictureHistory history;
    coarse.render(settings, {.history = &history});
    const RenderResult after_coarse = fine.render(settings, {.history = &history});
    EXPECT_FALSE(same_bits(after_coarse.beauty, plain));
    history.forget();
    const RenderResult forgotten = fine.render(settings, {.history = &history});
    EXPECT_TRUE(same_bits(forgotten.beauty, plain));
    EXPECT_TRUE(forgotten.stats.biases.empty());
}

TEST_F(PreviewPictureTest, IsEqualInBandsAndInTurns) {
    RenderSettings settings = small_settings(cornell.cameras[0], 45, 60, 2, 3);
    settings.want_view = true;
    const RenderResult whole = second_picture(prepared_cornell, settings, 2);
    settings.band_pixels = 48 * 16;
    expect_same(second_picture(prepared_cornell, settings, 2), whole);
    settings.in_turns = true;
    expect_same(second_picture(prepared_cornell, settings, 2), whole);
    EXPECT_TRUE(same_bits(whole.view, colors.view({}).apply(whole.beauty))) << "the view is another picture's";
}

/// An orbit of one-sample frames without a stop: the last frame has much smaller errors.
TEST_F(PreviewPictureTest, LowersErrorsWhileTheCameraMoves) {
    constexpr int kFrames = 12;
    const Scene scene = load_gltf(HALFLIGHT_SOURCE_DIR "/scenes/room.glb");
    PreparedScene prepared(context, scene);
    const RenderSettings settings = small_settings(scene.cameras[0], 128, 72, 1, 4);
    const auto camera_of = [&](int frame) {
        Camera camera = settings.camera;
        camera.camera_to_world = camera.camera_to_world * glm::rotate(dmat4(1), 0.01 * frame, dvec3(0, 1, 0));
        return moved(camera, 0.02 * frame);
    };
    FrameSettings last = settings;
    last.camera = camera_of(kFrames - 1), last.samples = 256, last.seed = 99;
    const Image reference = renderer(prepared, settings, {}).render(last).beauty;
    const auto render = [&](const Preview& preview) {
        Renderer r = renderer(prepared, settings, preview);
        PictureHistory history;
        RenderResult result;
        for (int i = 0; i < kFrames; ++i) {
            FrameSettings frame = settings;
            frame.camera = camera_of(i), frame.samples = 1;
            frame.frame = static_cast<std::uint32_t>(i);
            result = r.render(frame, {.history = &history});
        }
        EXPECT_EQ(result.stats.biases.size(), std::size_t(preview.temporal) + std::size_t(preview.filter));
        return result.beauty;
    };
    const Image both = render(kBoth);
    const double off = relative_error(render({}), reference);
    EXPECT_LT(relative_error(render({.temporal = true}), reference), off / 20);
    EXPECT_LT(relative_error(both, reference), off / 80);
    EXPECT_NEAR(mean_of(rgb(both)) / mean_of(rgb(reference)), 1, 0.1) << "only clipped outliers lose light";
}

}  // namespace
}  // namespace halflight::test
