// Tests that parts of the samples, rendered apart and merged, make the picture of one renderer, bit for bit.
#include <gtest/gtest.h>

#include <list>

#include "engine/core/error.h"
#include "renderer/checkpoint.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/error_message.h"
#include "tests/support/gpu_test.h"
#include "tests/support/process.h"

namespace halflight::test {
namespace {

class SampleParts : public GpuTest {
  protected:
    RenderSettings settings(bool denoise) const {
        RenderSettings s = all_settings(scene, 45, 60, 11);  // parts of 2, 3, 3 and 3 samples
        s.band_pixels = 48 * 32;
        s.parts = 4;
        s.denoise = denoise;
        return s;
    }
    std::filesystem::path folder_of(int part) const { return folder / fmt::format("{}", part); }
    /// Renders a part with a renderer of its own, and stops after `calls` calls of the callback; 0: does not stop.
    void render_part(const RenderSettings& s, int part, int calls = 0) {
        Checkpoint checkpoint(folder_of(part), "cornell", 1e9);
        FrameSettings own = settings_of_part(s, part);
        own.checkpoint = &checkpoint;
        int count = 0;
        Renderer(prepared, colors, s).render(own, [&](const RenderProgress&) { return ++count != calls; });
    }
    RenderResult merged(const RenderSettings& s) {
        std::list<Checkpoint> parts;
        std::vector<const Checkpoint*> all;
        for (int part = 1; part <= s.parts; ++part)
            all.push_back(&parts.emplace_back(folder_of(part), "cornell", 1e9, Checkpoint::Use::merge));
        FrameSettings own = s;
        own.merged = all;
        return Renderer(prepared, colors, s).render(own);
    }

    TemporaryFolder folder;
    Scene scene = shiny_cornell();
    PreparedScene prepared{context, scene};
    ColorConfig colors = ColorConfig::load();
};

TEST_F(SampleParts, MergedPartsAreThePictureOfOneRenderer) {
    for (const bool denoise : {false, true}) {
        const RenderSettings s = settings(denoise);
        const RenderResult expected = Renderer(prepared, colors, s).render();
        EXPECT_EQ(expected.stats.samples, 11);
        render_part(s, 3, 4);  // stops within the second band, and goes on later
        for (const int part : {4, 2, 3, 1}) render_part(s, part);
        const RenderResult result = merged(s);
        expect_same(result, expected);
        EXPECT_EQ(result.stats.samples, 11);
        for (int part = 1; part <= 4; ++part) Checkpoint(folder_of(part), "cornell", 1).remove();
    }
}

TEST_F(SampleParts, SumsOfPartsDifferFromASingleSumByRoundingAlone) {
    RenderSettings s = settings(false);
    const RenderResult parts = Renderer(prepared, colors, s).render();
    s.parts = 1;
    const RenderResult whole = Renderer(prepared, colors, s).render();
    for (std::size_t i = 0; i < whole.beauty.pixels.size(); ++i)
        EXPECT_NEAR(parts.beauty.pixels[i], whole.beauty.pixels[i], 1e-7 * whole.beauty.pixels[i]);
}

TEST_F(SampleParts, IncompletePartsAreRefused) {
    const RenderSettings s = settings(false);
    for (const int part : {1, 2, 4}) render_part(s, part);
    render_part(s, 3, 4);
    EXPECT_EQ(error_message([&] { merged(s); }), folder_of(3).string() + ": part 3 of 4 is not complete");
    RenderSettings many = s;
    many.parts = 12;
    EXPECT_NE(error_message([&] { Renderer(prepared, colors, many).render(); }).find("more parts than samples"),
              std::string::npos);
}

TEST_F(SampleParts, RangesCoverAllSamplesOnce) {
    FrameSettings s;
    for (const int samples : {1, 7, 64, 1000003})
        for (const int parts : {1, 3, 64}) {
            s.samples = samples, s.parts = parts;
            int next = 0;
            for (int part = 1; part <= parts; ++part) {
                const FrameSettings own = settings_of_part(s, part);
                EXPECT_EQ(own.first_sample, next);
                EXPECT_EQ(own.of_samples, samples);
                EXPECT_GE(own.samples, samples / parts);
                next += own.samples;
            }
            EXPECT_EQ(next, samples);
        }
}

}  // namespace
}  // namespace halflight::test
