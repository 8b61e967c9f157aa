// Tests how the memory estimate depends on settings and scene.
#include "renderer/memory.h"

#include <gtest/gtest.h>

namespace halflight {
namespace {

SceneNeeds lit_scene() {
    SceneNeeds scene;
    scene.diffuse = scene.emission = scene.area_lights = true;
    return scene;
}

RenderSettings settings_of(int width, int height) {
    RenderSettings s;
    s.width = width, s.height = height;
    return s;
}

MemoryEstimate of(const RenderSettings& s, const PictureUse& use = {}, const SceneNeeds& scene = lit_scene(),
                  const SceneSize& size = {}) {
    return estimate_memory(scene, size, s, use);
}

constexpr std::size_t kPixels = 1280 * 720;

TEST(Memory, FilmsGrowWithPixelsAndLayers) {
    const MemoryEstimate small = of(settings_of(1280, 720)), wide = of(settings_of(2560, 720));
    EXPECT_EQ(small.film, kPixels * 4 * sizeof(float));
    EXPECT_EQ(wide.film, 2 * small.film);
    RenderSettings layers = settings_of(1280, 720);
    layers.aovs = {"depth", "cryptoobject", "ids"};
    EXPECT_EQ(of(layers).film, kPixels * (4 + 1 + 12 + 3) * sizeof(float));
    EXPECT_EQ(of(settings_of(1280, 720), {.png = true}).film, 2 * small.film);
    EXPECT_GE(of(settings_of(1280, 720), {.png = true}).writing, small.writing + kPixels * 15);
}

TEST(Memory, WritingCountsRowsOfTilesAndAlpha) {
    const RenderSettings s = settings_of(1280, 2048);
    EXPECT_EQ(of(s, {.exr_tile = 64}).writing, of(s).writing);
    EXPECT_EQ(of(s, {.exr_tile = 1024}).writing, 4 * of(s).writing);
    EXPECT_EQ(of(s, {.exr_tile = 4096}).writing, 8 * of(s).writing) << "there are no further rows";
    RenderSettings transparent = s;
    transparent.transparent = true;
    const PictureUse png{.exr = false, .png = true};
    EXPECT_EQ(3 * of(transparent, png).writing, 4 * of(s, png).writing);
}

/// All large pictures need the same memory for a band, except for textures as large as the picture.
TEST(Memory, BandsDoNotGrowWithThePicture) {
    const MemoryEstimate small = of(settings_of(320, 180)), large = of(settings_of(3840, 2160)),
                         larger = of(settings_of(7680, 4320));
    EXPECT_LT(small.band * 5, large.band);
    EXPECT_LT(larger.band, large.band + large.band / 2);
    RenderSettings few = settings_of(3840, 2160);
    few.band_pixels /= 4;
    EXPECT_LT(of(few).band, large.band * 2 / 3);
    EXPECT_EQ(of(few).film, large.film);
}

TEST(Memory, OmittedPartsTakeNoMemory) {
    const MemoryEstimate all = of(settings_of(1280, 720));
    RenderSettings direct = settings_of(1280, 720), lights = direct, shared = direct, piloted = direct;
    direct.bounces = 1, lights.bounces = 0;
    EXPECT_LT(of(direct).band, all.band);
    EXPECT_LT(of(lights).band, of(direct).band);
    EXPECT_LT(of(settings_of(1280, 720), {}, {}).band, all.band);
    shared.estimator.reuse = Reuse::four;
    EXPECT_GT(of(shared).band, all.band + kPixels * 4 * 40);
    piloted.estimator.reuse = Reuse::automatic;  // groups of 16, and therefore smaller bands
    EXPECT_GT(of(piloted).band, all.band / 2);
    SceneNeeds shiny = lit_scene();
    shiny.glossy = shiny.sun = true;
    EXPECT_GE(of(settings_of(1280, 720), {}, shiny).band, all.band + kPixels * (2 * 16 + 120));
}

TEST(Memory, LayersAreReadBackFromBands) {
    const std::size_t plain = of(settings_of(1280, 720)).reading;
    const auto more = [&](const char* aov) {
        RenderSettings s = settings_of(1280, 720);
        s.aovs = {aov};
        return (of(s).reading - plain) / kPixels;
    };
    EXPECT_EQ(more("emission"), 128u);
    EXPECT_EQ(more("variance"), 128u + 24);
    EXPECT_EQ(more("normal"), 48u);
    EXPECT_EQ(more("depth"), 32u);
    EXPECT_EQ(more("nodes"), 20u);
    EXPECT_GE(more("cryptoobject"), 20u + 4 + 12);
    RenderSettings error = settings_of(1280, 720);
    error.error.emplace();
    EXPECT_EQ((of(error).reading - plain) / kPixels, 128u + 3 * (8 + 8 * 4));
}

/// Bands that grow together up to an error keep their sums and replicates.
TEST(Memory, AdaptiveErrorTargetsKeepAllBands) {
    RenderSettings s = settings_of(3840, 2160);
    s.adaptive = true;
    const std::size_t fixed = of(s).reading;
    s.error.emplace();
    const MemoryEstimate all = of(s);
    const std::size_t pixels = std::size_t{3840} * 2160;
    EXPECT_GT(all.reading, fixed + pixels * (128 + 24 + 3 * (8 + 8 * 4)));
    EXPECT_LT(all.reading, 3 * pixels * (128 + 24 + 3 * (8 + 8 * 4)));
    s.band_pixels /= 4;
    EXPECT_NEAR(double(of(s).reading), double(all.reading), 0.2 * double(all.reading));
}

TEST(Memory, WholePictureStepsGrowWithThePicture) {
    RenderSettings s = settings_of(640, 480);
    EXPECT_EQ(of(s).preview, 0u);
    EXPECT_EQ(of(s).shutter, 0u);
    const MemoryEstimate blurred = of(s, {.shutter = true});
    EXPECT_EQ(blurred.shutter, 640u * 480 * (4 * sizeof(double) + 2 * 4 * sizeof(float)));
    s.preview.filter = true;
    const MemoryEstimate filtered = of(s);
    EXPECT_GE(filtered.preview, 640u * 480 * 16 * (5 + 7));
    s.preview.temporal = true;
    EXPECT_GE(of(s).preview, filtered.preview + 640u * 480 * 16 * 6);
    s.preview = {};
    s.denoise = true;
    const MemoryEstimate denoised = of(s);
    s.denoise_error = 16;
    EXPECT_GE(of(s).film, denoised.film + 640u * 480 * 2 * 16) << "two further pictures";
    s.denoise_error = 0;
    s.denoise_frames = 2;
    EXPECT_GE(of(s).preview, denoised.preview + 640u * 480 * 4 * (16 * (5 + 2 * 3 + 4) + 4 * sizeof(float)))
        << "textures and pictures of four neighbours";
}

TEST(Memory, ScenesCountTheirContents) {
    const RenderSettings s = settings_of(64, 64);
    const SceneSize size{.geometry_bytes = 1000, .texture_bytes = 10000, .stored = 10, .drawn = 10};
    const std::size_t bytes = of(s, {}, lit_scene(), size).scene;
    EXPECT_GE(bytes, 2u * 11000 + 10 * 200);
    SceneSize moving = size;
    moving.moves = true;
    EXPECT_GT(of(s, {}, lit_scene(), moving).scene, bytes);
    const MemoryEstimate all = of(s, {}, lit_scene(), size);
    EXPECT_EQ(all.total(), all.program + all.scene + all.band + all.visibility + all.reading + all.film + all.writing);
    SceneSize decoded = size;
    decoded.decoding_bytes = 1 << 20;
    EXPECT_EQ(scene_bytes(decoded), 11000u + (1 << 20));
}

/// Bands and visibility state shrink before a picture is too large, and pictures need the same whatever the scene.
TEST(Memory, PicturesAreFitted) {
    RenderSettings s = settings_of(1920, 1080);
    s.aovs = {"normal"};
    const MemoryEstimate usual = of(s);
    const auto fitted = [&](std::size_t bytes) {
        RenderSettings own = s;
        const MemoryEstimate m = fit_into_memory(lit_scene(), {}, own, {}, bytes);
        EXPECT_EQ(m.picture(), of(own).picture());
        EXPECT_EQ(m.film, usual.film);
        return std::pair(own, m);
    };
    EXPECT_EQ(fitted(usual.picture()).second.picture(), usual.picture());
    EXPECT_EQ(fitted(usual.picture()).first.band_pixels, s.band_pixels);
    for (const std::size_t divisor : {2, 4, 8}) {
        const std::size_t bytes = usual.film + usual.writing + (usual.picture() - usual.film - usual.writing) / divisor;
        EXPECT_LE(fitted(bytes).second.picture(), bytes) << divisor;
    }
    const std::size_t least = least_picture_bytes(s, {});
    EXPECT_EQ(least, usual.film + usual.writing);
    EXPECT_GT(fitted(least).second.picture(), least);
    EXPECT_LT(fitted(least).second.picture(), least + (64 << 20));
    EXPECT_LT(least_picture_bytes(settings_of(0, 1080), {}), least / 100);
}

}  // namespace
}  // namespace halflight
