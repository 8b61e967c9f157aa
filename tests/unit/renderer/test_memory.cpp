// Tests how the memory estimate depends on settings and scene.
#include "renderer/memory.h"

#include <gtest/gtest.h>

#include "renderer/replicates.h"
#include "shaders/shared/ray_structs.h"

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
    const RenderSettings hd = settings_of(1280, 720);
    const MemoryEstimate small = of(hd);
    EXPECT_EQ(small.film, kPixels * 4 * sizeof(float));
    EXPECT_EQ(of(settings_of(2560, 720)).film, 2 * small.film);
    RenderSettings layers = hd;
    layers.aovs = {"depth", "cryptoobject", "ids"};
    EXPECT_EQ(of(layers).film, kPixels * (4 + 1 + 12 + 3) * sizeof(float));
    EXPECT_EQ(of(hd, {.png = true}).film, 2 * small.film);
    EXPECT_GE(of(hd, {.png = true}).writing, small.writing + kPixels * 15);
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
    const std::size_t all = of(settings_of(1280, 720)).band;
    const auto band = [](int bounces, Reuse reuse, const SceneNeeds& scene = lit_scene()) {
        RenderSettings s = settings_of(1280, 720);
        s.bounces = bounces, s.estimator.reuse = reuse;
        return of(s, {}, scene).band;
    };
    EXPECT_LT(band(1, Reuse::off), all);
    EXPECT_LT(band(0, Reuse::off), band(1, Reuse::off));
    EXPECT_LT(band(kBounces, Reuse::off, {}), all);
    EXPECT_GT(band(kBounces, Reuse::four), all + kPixels * 4 * sizeof(shared::Ray));
    EXPECT_GT(band(kBounces, Reuse::automatic), all / 3) << "groups of 16, and therefore smaller bands";
    SceneNeeds glossy = lit_scene(), sunny = lit_scene();
    glossy.glossy = sunny.sun = true;
    EXPECT_GT(band(kBounces, Reuse::off, glossy), all);
    EXPECT_GE(band(kBounces, Reuse::off, sunny), all + kPixels * 2 * sizeof(shared::Ray));
}

TEST(Memory, LayersAreReadBackFromBands) {
    const std::size_t plain = of(settings_of(1280, 720)).reading;
    const auto more = [&](const char* aov) {
        RenderSettings s = settings_of(1280, 720);
        s.aovs = {aov};
        return (of(s).reading - plain) / kPixels;
    };
    for (const char* aov : {"emission", "variance", "normal", "depth", "nodes", "cryptoobject"})
        EXPECT_GE(more(aov), sizeof(float) * find_aov(aov)->channel_names().size()) << aov;
    EXPECT_GE(more("variance"), more("emission") + 3 * sizeof(double)) << "squares";
    RenderSettings error = settings_of(1280, 720);
    error.error.emplace();
    EXPECT_GE((of(error).reading - plain) / kPixels, more("emission") + kReplicates * 3 * sizeof(float));
}

TEST(Memory, AdaptiveErrorTargetsKeepAllBands) {
    RenderSettings s = settings_of(3840, 2160);
    s.adaptive = true;
    s.error.emplace();
    const MemoryEstimate all = of(s);
    const std::size_t replicates = std::size_t{3840} * 2160 * kReplicates * 3 * sizeof(float);
    EXPECT_GT(all.reading, replicates);
    EXPECT_LT(all.reading, 8 * replicates);
    s.band_pixels /= 4;
    EXPECT_NEAR(double(of(s).reading), double(all.reading), 0.2 * double(all.reading));
}

TEST(Memory, WholePictureStepsGrowWithThePicture) {
    constexpr std::size_t kTexels = 640 * 480 * sizeof(vec4);
    RenderSettings s = settings_of(640, 480);
    EXPECT_EQ(of(s).preview, 0u);
    s.preview.filter = true;
    const std::size_t filtered = of(s).preview;
    EXPECT_GE(filtered, 5 * kTexels);
    s.preview.temporal = true;
    EXPECT_GE(of(s).preview, filtered + 6 * kTexels);
    s.preview = {};
    s.denoise = true;
    const MemoryEstimate denoised = of(s);
    EXPECT_GE(denoised.preview, 5 * kTexels);
    s.denoise_error = 16;
    EXPECT_GE(of(s).film, denoised.film + 2 * kTexels) << "two further pictures";
    s.denoise_error = 0;
    s.denoise_frames = 2;
    EXPECT_GE(of(s).preview, denoised.preview + 4 * (5 + 2 * 3 + 4 + 1) * kTexels) << "pictures of four neighbours";
    s.denoise_frames = 0;
    s.keep_noisy = true;
    EXPECT_GE(of(s).preview, denoised.preview + 2 * (5 + 2 * 3 + 1) * kTexels) << "a file, and its channels";
}

TEST(Memory, ScenesCountTheirContents) {
    SceneSize size{.geometry_bytes = 1000, .texture_bytes = 10000, .stored = 10, .drawn = 10};
    const std::size_t bytes = scene_bytes(size);
    EXPECT_GE(bytes, 2u * 11000 + 10 * 200);
    const MemoryEstimate all = of(settings_of(64, 64), {}, lit_scene(), size);
    EXPECT_EQ(all.scene, bytes);
    EXPECT_EQ(all.total(), all.program + all.scene + all.band + all.visibility + all.reading + all.film + all.writing);
    size.moves = true;
    EXPECT_GT(scene_bytes(size), bytes);
    size.decoding_bytes = 1 << 20;
    EXPECT_EQ(scene_bytes(size), 11000u + (1 << 20));
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
