// Tests pictures published while samples are added: bands take turns, and publishing changes nothing.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "engine/core/error.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

using rays::Culling;

class InTurns : public GpuTest {
  protected:
    /// Returns settings of 45 x 60 pixels in four bands or in one, with all layers.
    RenderSettings settings(int samples, bool one_band = false) const {
        RenderSettings s = all_settings(scene, 45, 60, samples);
        s.culling = Culling::off;
        s.band_pixels = one_band ? 48 * 64 : 48 * 16;
        s.in_turns = true;
        return s;
    }
    /// Renders one band after the other instead of taking turns.
    RenderResult expected(RenderSettings s) {
        s.in_turns = false;
        return Renderer(prepared, colors, s).render();
    }

    Scene scene = shiny_cornell();
    PreparedScene prepared{context, scene};
    ColorConfig colors = ColorConfig::load();
};

TEST_F(InTurns, ThePictureIsEqual) {
    const RenderResult whole = expected(settings(7));
    for (const Culling culling : {Culling::off, Culling::compute, Culling::raster, Culling::automatic}) {
        for (const std::size_t state_bytes : {std::size_t{1} << 20, std::size_t{0}}) {
            SCOPED_TRACE(fmt::format("{}, {} bytes of state", rays::name(culling), state_bytes));
            RenderSettings s = settings(7);
            s.culling = culling;
            s.state_bytes = state_bytes;
            Renderer renderer(prepared, colors, s);
            const RenderResult first = renderer.render();
            expect_same(first, whole);
            EXPECT_EQ(first.stats.samples, 7);
            EXPECT_EQ(first.stats.paths, 45u * 60 * 7);
            expect_same(renderer.render(), whole);
        }
    }
}

TEST_F(InTurns, EveryIntermediatePictureEqualsOneOfItsSampleCount) {
    std::vector<RenderResult> of;
    for (int samples = 1; samples <= 4; ++samples) of.push_back(expected(settings(samples)));
    for (const bool one_band : {false, true}) {
        for (const bool in_turns : {false, true}) {
            SCOPED_TRACE(fmt::format("one band {}, in turns {}", one_band, in_turns));
            RenderSettings s = settings(4, one_band);
            s.in_turns = in_turns;
            Renderer renderer(prepared, colors, s);
            int looks = 0;
            const RenderResult last = renderer.render([&](const RenderProgress& p) {
                if (!p.picture) return true;
                const RenderResult seen = p.picture(s.aovs);
                EXPECT_EQ(seen.stats.samples, p.samples_done);
                expect_same(seen, of.at(std::size_t(p.samples_done - 1)));
                EXPECT_EQ(seen.attributes, of[0].attributes);
                ++looks;
                return true;
            });
            EXPECT_EQ(looks, one_band || in_turns ? 4 : 0) << "without turns the sums of earlier bands are gone";
            expect_same(last, of[3]);
        }
    }
}

TEST_F(InTurns, ComponentsCanBeRequestedAfterTheSamples) {
    const std::vector<std::string> components = {"indirect_diffuse", "emission", "samples"};
    RenderSettings s = settings(2);
    s.aovs = components;
    const RenderResult asked_before = expected(s);
    s.aovs = {"normal", "depth"};
    const RenderResult data = expected(s);
    s.in_turns = true;
    Renderer renderer(prepared, colors, s);
    renderer.render([&](const RenderProgress& p) {
        if (!p.picture || p.samples_done < 2) return true;
        expect_same(p.picture(components), asked_before);
        expect_same(p.picture(s.aovs), data);
        EXPECT_TRUE(p.picture({}).aovs.empty());
        EXPECT_THROW(p.picture({"albedo"}), Error) << "it has not been summed";
        return true;
    });
}

TEST_F(InTurns, StoppingReturnsTheSamplesSoFar) {
    Renderer renderer(prepared, colors, settings(4));
    int calls = 0;
    const RenderResult stopped = renderer.render([&](const RenderProgress&) { return ++calls < 6; });
    EXPECT_TRUE(stopped.stats.interrupted);
    EXPECT_EQ(stopped.stats.samples, 1);
    EXPECT_EQ(stopped.stats.paths, 45u * (60 + 2 * 16));
    const Image& samples = layer(stopped, "samples.Y");
    for (int y = 0; y < 60; ++y) EXPECT_EQ(*samples.at(20, y), y < 32 ? 2 : 1) << y;
}

TEST_F(InTurns, ExceptionsOfTheCallbackPropagate) {
    Renderer renderer(prepared, colors, settings(3));
    struct Stop {};
    int calls = 0;
    EXPECT_THROW(renderer.render([&](const RenderProgress&) { return ++calls < 6 ? true : throw Stop(); }), Stop);
    expect_same(renderer.render(), expected(settings(3)));
}

TEST_F(InTurns, AnErrorIsReachedBandByBand) {
    RenderSettings s = settings(32);
    s.error = ErrorTarget{ErrorMetric::relmse, 1e3};
    Renderer renderer(prepared, colors, s);
    const RenderResult result = renderer.render([](const RenderProgress& p) {
        EXPECT_FALSE(p.picture) << "replicates are no running mean";
        return true;
    });
    ASSERT_TRUE(result.stats.error);
    expect_same(result, expected(s));
}

}  // namespace
}  // namespace halflight::test
