// Tests the radiance cache of the preview: the sums of its cells, its effect on pictures, and the hand-over to unbiased
// samples.
#include "passes/light/radiance_cache.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "engine/core/metrics.h"
#include "engine/core/statistics.h"
#include "engine/io/gltf/gltf.h"
#include "renderer/hand_over.h"
#include "shaders/shared/cache_cells.h"
#include "shaders/shared/path_state.h"
#include "shaders/shared/reuse_groups.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

class RadianceCacheTest : public GpuTest {
  protected:
    static RenderSettings settings_of(const Scene& scene, int samples, bool cache = true) {
        RenderSettings s = small_settings(scene.cameras.front(), 48, 48, samples, 5);
        s.preview.cache = cache;
        return s;
    }
    /// Renders with a new renderer, whose cache is empty.
    RenderResult cold(const Scene& scene, const RenderSettings& s) { return render(context, scene, s); }

    static double mean_indirect(const RenderResult& r) {
        return mean_of(layer(r, "indirect_diffuse.R")) + mean_of(layer(r, "indirect_glossy.R"));
    }
    Scene load(const char* name) { return load_gltf(std::string(HALFLIGHT_SOURCE_DIR) + "/scenes/" + name); }
};

/// Fixture that feeds one cell by the kernel alone.
class CacheCells : public GpuTest {
  protected:
    static constexpr std::uint32_t kCell = 5, kKey = 77;

    shared::CacheCell fed_with(const std::vector<vec3>& light, std::uint32_t key_in_cell = kKey) {
        const std::size_t paths = (light.size() + 63) / 64 * 64;
        std::vector<shared::PathState> states(paths);
        std::vector<shared::CachePoint> points(paths);
        for (std::size_t i = 0; i < light.size(); ++i) {
            states[i].lobe = shared::kLobeDiffuse;
            states[i].reuse = shared::kReuseCell | shared::kReusePoint;
            points[i].light = light[i];
            points[i].key0 = kKey;
            points[i].cell0 = kCell;
            points[i].cell1 = points[i].cell2 = shared::kNoCacheCell;
        }
        std::vector<shared::CacheCell> cells(8);
        cells[kCell].key = key_in_cell;
        const gpu::Buffer states_buffer = gpu::Buffer::from("states", states);
        const gpu::Buffer points_buffer = gpu::Buffer::from("points", points);
        const gpu::Buffer cells_buffer = gpu::Buffer::from("cells", cells);
        const gpu::Buffer counts_buffer("counts", sizeof(shared::CacheCounts));
        const gpu::Program program = gpu::Program::compute("shaders/radiance_cache_feed.comp");
        program.bind_storage("States", states_buffer);
        program.bind_storage("Points", points_buffer);
        program.bind_storage("Cells", cells_buffer);
        program.bind_storage("Counts", counts_buffer);
        program.set("picture", 9u);
        program.dispatch(static_cast<std::uint32_t>(paths / 64));
        refused = counts_buffer.read<std::uint32_t>()[0];
        return cells_buffer.read<shared::CacheCell>()[kCell];
    }
    static double sum(const shared::CacheCell& c, int channel) {
        return double{shared::kCacheUnit} * (c.high[channel] + std::ldexp(c.low[channel], -32));
    }

    std::uint32_t refused = 0;
};

TEST_F(CacheCells, SumPathRadiance) {
    std::vector<vec3> light;
    dvec3 sums(0);
    for (int i = 0; i < 1000; ++i) {
        light.emplace_back(0.37f * static_cast<float>(i), 1e-5f * static_cast<float>(i), i % 7 == 0 ? 60000.0f : 0.0f);
        sums += dvec3(light.back());
    }
    const shared::CacheCell cell = fed_with(light);
    EXPECT_EQ(cell.count, 1000u);
    EXPECT_EQ(cell.used, 9u);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(sum(cell, c), sums[c], 1000 * 8e-9 + 1e-9 * sums[c]) << c;
    EXPECT_EQ(refused, 2000u) << "there were no cells of the other lengths";
    std::ranges::reverse(light);
    const shared::CacheCell same = fed_with(light);
    for (int c = 0; c < 3; ++c) EXPECT_TRUE(same.low[c] == cell.low[c] && same.high[c] == cell.high[c]) << c;
}

TEST_F(CacheCells, IgnoreNonFiniteRadiance) {
    const float inf = std::numeric_limits<float>::infinity();
    const shared::CacheCell cell =
        fed_with({{1, 2, 3}, {kNan, 1, 1}, {1, inf, 1}, {1, 1, -1}, {-inf, 0, 0}, {3, 2, 1}, {1e30f, 0, 0}});
    EXPECT_EQ(cell.count, 3u);
    EXPECT_NEAR(sum(cell, 0), 4 + shared::kCacheBrightest, 1e-6);
    EXPECT_NEAR(sum(cell, 1), 4, 1e-6);
    EXPECT_NEAR(sum(cell, 2), 4, 1e-6);
}

TEST_F(CacheCells, OfOtherKeysAreUnchanged) {
    const shared::CacheCell cell = fed_with({{1, 2, 3}}, kKey + 1);
    EXPECT_EQ(cell.count, 0u);
    EXPECT_EQ(sum(cell, 0), 0);
    EXPECT_EQ(refused, 3u);
}

TEST_F(RadianceCacheTest, ClosedRoomsSumTheSeriesOfTheirAlbedo) {
    const double albedo = 0.8;
    Material glowing = diffuse_material(vec3(0.8f));
    glowing.emission = vec3(1);
    Scene scene = closed_box(glowing);
    scene.cameras = {camera_in_box()};
    const double exact = (std::pow(albedo, 2) - std::pow(albedo, 6)) / (1 - albedo);
    RenderSettings s = settings_of(scene, kCachedSamples);
    PreparedScene prepared(context, scene);
    Renderer renderer(prepared, ColorConfig::load(), s);
    for (int picture = 0; picture < 3; ++picture) {
        const RenderResult r = renderer.render();
        EXPECT_NEAR(mean_indirect(r), exact, 0.01 * exact) << picture;
        for (const BadValues& bad : r.stats.bad_values) EXPECT_EQ(bad.total(), 0u) << bad.component;
        EXPECT_EQ(r.stats.biases.size(), 1u);
    }
}

/// Compares an empty and a warm cache with the unbiased mean of many samples. The remaining noise comes from the first
/// bounce.
TEST_F(RadianceCacheTest, HasLittleBiasAndLittleNoise) {
    const struct {
        const char* name;
        double cold_error, warm_error;  // upper limits of the error, relative to the error without cache
    } scenes[] = {{"room.glb", 0.6, 0.5}, {"cornell.glb", 0.85, 0.8}};
    constexpr int kSeeds = 8;
    for (const auto& [name, cold_error, warm_error] : scenes) {
        SCOPED_TRACE(name);
        const Scene scene = load(name);
        PreparedScene prepared(context, scene);
        const ColorConfig colors = ColorConfig::load();
        const RenderResult truth = Renderer(prepared, colors, settings_of(scene, 512, false)).render();
        const Image& true_diffuse = layer(truth, "indirect_diffuse.R");
        const double light = mean_indirect(truth);
        RenderSettings s = settings_of(scene, kCachedSamples);
        Renderer cached(prepared, colors, s);
        Renderer plain(prepared, colors, settings_of(scene, kCachedSamples, false));
        struct {
            RunningMoments light, error;
            void add(const RenderResult& r, const Image& truth) {
                light.add(mean_indirect(r));
                error.add(mean_of(squared_error_map(layer(r, "indirect_diffuse.R"), truth)));
            }
        } off, cold, warm;
        for (s.seed = 1; s.seed <= kSeeds; ++s.seed) {
            off.add(plain.render(s), true_diffuse);
            cached.forget("the next one is to be cold");
            cold.add(cached.render(s), true_diffuse);
            FrameSettings other = s;
            for (other.seed = 101; other.seed <= 102; ++other.seed) cached.render(other);
            warm.add(cached.render(s), true_diffuse);
        }
        for (const auto* of : {&cold, &warm}) {
            EXPECT_NEAR(of->light.mean(), light, 0.03 * light + 3 * of->light.standard_error());
            EXPECT_LT(of->light.standard_error(), 0.02 * light) << "the test has no power";
        }
        EXPECT_LT(cold.error.mean(), cold_error * off.error.mean());
        EXPECT_LT(warm.error.mean(), warm_error * off.error.mean());
    }
}

TEST_F(RadianceCacheTest, HandsOverToTheExactUnbiasedMean) {
    const Scene scene = shiny_cornell();
    RenderSettings s = all_settings(scene, 45, 40, kHandedOver);
    s.culling = rays::Culling::off;
    s.band_pixels = 48 * 16;
    RenderSettings plain = s;
    s.preview.cache = true;
    for (const bool in_turns : {false, true}) {
        s.in_turns = in_turns;
        s.samples = kHandedOver;
        plain.samples = kHandedOver - kCachedSamples;
        const RenderResult handed_over = cold(scene, s);
        expect_same(handed_over, cold(scene, plain));
        EXPECT_TRUE(handed_over.stats.biases.empty());
        EXPECT_EQ(handed_over.stats.samples, kHandedOver);
        s.samples = kHandedOver - 1;
        EXPECT_EQ(cold(scene, s).stats.biases.size(), 1u);
    }
}

/// Bands that are rendered in turns keep cached and unbiased sums of their own.
TEST_F(RadianceCacheTest, HandsOverAlikeWithAndWithoutTurns) {
    const Scene scene = shiny_cornell();
    RenderSettings s = all_settings(scene, 45, 40, kCachedSamples + 10);
    s.culling = rays::Culling::off;
    s.preview.cache = true;
    const RenderResult whole = cold(scene, s);
    s.band_pixels = 48 * 16;
    s.in_turns = true;
    const RenderResult in_turns = cold(scene, s);
    // Light that the cache does not replace.
    for (const char* name : {"emission.R", "direct_diffuse.G", "direct_glossy.B"})
        EXPECT_EQ(layer(in_turns, name).pixels, layer(whole, name).pixels) << name;
}

/// During the hand-over, the picture is the weighted mean of cached and unbiased samples, and so is its variance.
TEST_F(RadianceCacheTest, WeightsBothMeansDuringTheHandOver) {
    const Scene scene = shiny_cornell();
    const int others = 10;
    const RenderResult cached = cold(scene, settings_of(scene, kCachedSamples));
    const RenderResult plain = cold(scene, settings_of(scene, others, false));
    const RenderResult both = cold(scene, settings_of(scene, kCachedSamples + others));
    const double weight = cached_weight(kCachedSamples + others);
    ASSERT_GT(weight, 0);
    for (const char* name : {"emission.R", "direct_diffuse.G", "indirect_diffuse.R", "indirect_glossy.B"}) {
        const Image &a = layer(cached, name), &b = layer(plain, name), &c = layer(both, name);
        for (std::size_t i = 0; i < c.pixels.size(); ++i) {
            const double expected = weight * a.pixels[i] + (1 - weight) * b.pixels[i];
            ASSERT_NEAR(c.pixels[i], expected, 1e-5 * expected + 1e-9) << name;
        }
    }
    const Image &a = layer(cached, "variance.R"), &b = layer(plain, "variance.R"), &c = layer(both, "variance.R");
    for (std::size_t i = 0; i < c.pixels.size(); ++i) {
        const double expected = weight * weight * a.pixels[i] + (1 - weight) * (1 - weight) * b.pixels[i];
        ASSERT_NEAR(c.pixels[i], expected, 1e-4 * expected + 1e-9);
    }
}

TEST_F(RadianceCacheTest, PicturesAreReproducibleWithEveryTracer) {
    const Scene scene = shiny_cornell();
    RenderSettings s = all_settings(scene, 45, 40, 3);
    s.aovs = {"indirect_diffuse", "indirect_glossy", "variance"};
    s.preview.cache = true;
    s.culling = rays::Culling::off;
    PreparedScene prepared(context, scene);
    std::vector<RenderResult> first;
    for (const rays::Culling culling :
         {rays::Culling::off, rays::Culling::off, rays::Culling::compute, rays::Culling::raster}) {
        s.culling = culling;
        Renderer renderer(prepared, ColorConfig::load(), s);
        for (std::size_t picture = 0; picture < 3; ++picture) {
            const RenderResult r = renderer.render();
            if (first.size() <= picture) first.push_back(r);
            SCOPED_TRACE(rays::name(culling));
            expect_same(r, first[picture]);
        }
    }
    EXPECT_FALSE(same_bits(first[0].beauty, first[1].beauty)) << "the second picture continues from the first";
}

TEST_F(RadianceCacheTest, IsSharedAcrossCamerasAndCanBeCleared) {
    const Scene scene = cornell_box();
    PreparedScene prepared(context, scene);
    RenderSettings s = settings_of(scene, 1);
    s.measure = true;
    const RenderResult first = Renderer(prepared, ColorConfig::load(), s).render();
    ASSERT_TRUE(first.stats.radiance_cache);
    EXPECT_GT(first.stats.radiance_cache->used, 50u);

    const auto cache = std::make_shared<RadianceCache>();
    RenderSettings aside = s;
    aside.camera.camera_to_world[3].x += 0.2;
    aside.width = aside.height = 32;
    Renderer other(prepared, ColorConfig::load(), aside, nullptr, cache);
    for (aside.seed = 1; aside.seed <= 32; ++aside.seed) other.render(aside);
    Renderer renderer(prepared, ColorConfig::load(), s, nullptr, cache);
    const RenderResult warm = renderer.render();
    EXPECT_GT(warm.stats.radiance_cache->mature, 2 * first.stats.radiance_cache->mature);
    EXPECT_FALSE(same_bits(warm.beauty, first.beauty));
    cache->clear();
    expect_same(renderer.render(), first);
    renderer.forget("a cut");
    expect_same(renderer.render(), first);
}

TEST_F(RadianceCacheTest, EvictsUnusedCells) {
    const Scene scene = cornell_box();
    PreparedScene prepared(context, scene);
    const auto shared = std::make_shared<RadianceCache>();
    Renderer(prepared, ColorConfig::load(), settings_of(scene, 1), nullptr, shared).render();
    RadianceCache& cache = *shared;
    const std::size_t used = cache.statistics().used;
    ASSERT_GT(used, 50u);
    while (cache.picture() < 192) cache.begin_picture(prepared.programs());
    EXPECT_EQ(cache.statistics().used, used);
    while (cache.picture() < 256) cache.begin_picture(prepared.programs());
    EXPECT_EQ(cache.statistics().used, 0u);
}

/// Paths that end in the cache trace no further rays.
TEST_F(RadianceCacheTest, SavesRays) {
    const Scene scene = cornell_box();
    RenderSettings s = settings_of(scene, 1);
    s.measure = true;
    s.culling = rays::Culling::off;
    PreparedScene prepared(context, scene);
    Renderer renderer(prepared, ColorConfig::load(), s);
    const auto later_rays = [&](const RenderResult& r) {
        std::uint64_t rays = 0;
        for (const rays::BatchStatistics& b : r.stats.batches)
            if (b.batch.find("continuation") != std::string::npos)
                for (const auto& way : b.measured) rays += way.rays;
        return rays;
    };
    const std::uint64_t at_first = later_rays(renderer.render());
    for (int i = 0; i < 60; ++i) renderer.render();
    const std::uint64_t in_the_end = later_rays(renderer.render());
    EXPECT_LT(in_the_end, at_first / 2);
}

TEST_F(RadianceCacheTest, IsLeftOutWhereItHasNothingToStore) {
    const Scene scene = cornell_box();
    RenderSettings s = settings_of(scene, 2);
    s.bounces = 1;
    const RenderResult r = cold(scene, s);
    EXPECT_TRUE(r.stats.biases.empty());
    s.preview.cache = false;
    expect_same(r, cold(scene, s));
    s.bounces = 3;
    const RenderResult off = cold(scene, s);
    const auto named = [](const LeftOut& l) {
        return l.what == "radiance cache" && l.fact == "its preview mode is off";
    };
    EXPECT_EQ(std::ranges::count_if(off.stats.left_out, named), 1);
}

}  // namespace
}  // namespace halflight::test
