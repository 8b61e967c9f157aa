// Tests sequences of pictures by one renderer: its state persists and changes no picture.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "engine/core/error.h"
#include "engine/core/interruption.h"
#include "engine/rays/choice.h"
#include "engine/rays/tracer.h"
#include "engine/settings/visibility.h"
#include "renderer/metering.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

using rays::Culling;
using rays::TraceMethod;

class RendererTest : public GpuTest {
  protected:
    /// Returns settings of 45 x 60 pixels in four bands.
    RenderSettings banded(Culling culling) const {
        RenderSettings s = all_settings(scene, 45, 60, 3);
        s.culling = culling;
        s.band_pixels = 48 * 16;
        return s;
    }

    /// Returns frames with other cameras, seeds, numbers and sample counts; unset fields take the settings' values.
    std::vector<FrameSettings> frames(const FrameSettings& base) const {
        std::vector<FrameSettings> all(5, base);
        all[1].seed = 7;
        all[2].frame = 3, all[2].samples = 6;
        for (const std::size_t moved : {3u, 4u}) {
            all[moved].camera.camera_to_world[3] += 0.1 * double(moved) * base.camera.camera_to_world[0];
            all[moved].previous_camera = base.camera;
        }
        all[4].samples = 1;
        return all;
    }

    static const rays::BatchStatistics& shadow(const RenderResult& r) {
        return *std::ranges::find(r.stats.batches, "shadow", &rays::BatchStatistics::batch);
    }

    static std::uint64_t runs(const RenderResult& r, TraceMethod method) {
        return shadow(r).measured[static_cast<std::size_t>(method)].runs;
    }

    /// Returns the number of runs that `automatic` leaves to its first method.
    std::uint64_t runs_before_tiles() {
        Renderer renderer(prepared, colors, banded(Culling::automatic));
        return runs(renderer.render(), TraceMethod::native) > 0 ? rays::Tracer::kFirstNativeRuns
                                                                : rays::Choice::kFirstRuns;
    }

    Scene scene = shiny_cornell();
    PreparedScene prepared{context, scene};
    ColorConfig colors = ColorConfig::load();
};

TEST_F(RendererTest, PicturesDoNotDependOnEarlierPictures) {
    std::vector<RenderResult> expected;
    for (const FrameSettings& frame : frames(banded(Culling::off))) {
        Renderer fresh(prepared, colors, banded(Culling::off));
        expected.push_back(fresh.render(frame));
    }
    EXPECT_FALSE(same_bits(expected[0].beauty, expected[1].beauty));
    EXPECT_FALSE(same_bits(expected[0].beauty, expected[3].beauty));

    std::mt19937 random(1);
    for (const Culling culling : {Culling::off, Culling::compute, Culling::raster, Culling::automatic}) {
        // Memory for visibility state suffices for all bands, for two of the four, or for none.
        for (const std::size_t state_bytes : {std::size_t{1} << 20, std::size_t{15000}, std::size_t{0}}) {
            if (state_bytes < 1 << 20 && culling != Culling::compute) continue;
            SCOPED_TRACE(fmt::format("{}, {} bytes", rays::name(culling), state_bytes));
            RenderSettings settings = banded(culling);
            settings.state_bytes = state_bytes;
            Renderer renderer(prepared, colors, settings);
            const std::vector<FrameSettings> all = frames(settings);
            for (int i = 0; i < 6; ++i) {
                const std::size_t f = random() % all.size();
                SCOPED_TRACE(f);
                if (i % 3 == 2) renderer.forget("camera cut");
                expect_same(renderer.render(all[f]), expected[f]);
            }
        }
    }
}

TEST_F(RendererTest, ListsPersistAcrossBandsAndPictures) {
    // Shafts hold most rays after few samples if each path samples one light.
    PreparedScene by_power(context, scene, {.estimator = {.lights = LightChoice::power}});
    RenderSettings settings = banded(Culling::compute);
    Renderer renderer(by_power, colors, settings);
    const FrameSettings frame = frames(settings)[2];
    const RenderResult first = renderer.render(frame);
    const std::uint64_t tiles = 4 * 12 * 6;  // bands, tiles, samples
    EXPECT_EQ(shadow(first).tiles, tiles);
    EXPECT_GE(shadow(first).tiles_culled, tiles / 6) << "there was no state";
    EXPECT_EQ(shadow(first).state_bytes, 4 * 12 * (36 * 16 + 8u)) << "a record of tile_list.h and its blockers";
    const RenderResult again = renderer.render(frame);
    EXPECT_EQ(shadow(again).tiles, tiles) << "statistics are those of the picture";
    EXPECT_LT(shadow(again).tiles_culled, tiles / 15) << "shafts have grown to hold most rays of the picture";
    EXPECT_LT(shadow(renderer.render(frame)).tiles_culled, tiles / 25) << "and in the end nearly all";
    renderer.forget("camera cut");
    EXPECT_GE(shadow(renderer.render(frame)).tiles_culled, tiles / 6);

    settings.state_bytes = 0;
    Renderer sharing(by_power, colors, settings);
    sharing.render(frame);
    const RenderResult shared = sharing.render(frame);
    EXPECT_EQ(shadow(shared).state_bytes, 12 * (36 * 16 + 8u));
    EXPECT_GE(shadow(shared).tiles_culled, tiles / 6) << "the lists belong to another band";
}

TEST_F(RendererTest, TheFastestTracerIsFoundOnce) {
    Renderer renderer(prepared, colors, banded(Culling::automatic));
    FrameSettings frame = frames(banded(Culling::automatic))[2];
    frame.samples = static_cast<int>(runs_before_tiles()) + 2;
    const auto timed = [&](const RenderResult& r) {
        std::uint64_t sum = 0;
        for (const rays::BatchStatistics::Measured& m : shadow(r).measured) sum += m.timed;
        return sum;
    };
    const RenderResult first = renderer.render(frame);
    EXPECT_EQ(timed(first), 4u * 6) << "4 of the first way and 2 of the second in each of 4 bands";
    frame.samples = 6;
    const RenderResult second = renderer.render(frame);
    EXPECT_EQ(timed(second), 4u * 1) << "4 of the first way and 3 of the second decide";
    EXPECT_EQ(shadow(second).reason.find("undecided"), std::string::npos);
    EXPECT_EQ(timed(renderer.render(frame)), 0u) << "no trial";
}

TEST_F(RendererTest, EachBandHasItsOwnTrials) {
    RenderSettings settings = banded(Culling::automatic);
    const std::uint64_t before_tiles = runs_before_tiles();
    settings.samples = static_cast<int>(before_tiles) / 2;
    Renderer renderer(prepared, colors, settings);
    for (int picture = 0; picture < 2; ++picture) {
        const RenderResult r = renderer.render();
        EXPECT_EQ(runs(r, TraceMethod::plain) + runs(r, TraceMethod::native), 4 * before_tiles / 2)
            << "each batch had its first runs only";
        EXPECT_EQ(runs(r, TraceMethod::tiles), 0u);
    }
    FrameSettings two = settings;
    two.samples = 2;
    EXPECT_EQ(runs(renderer.render(two), TraceMethod::tiles), 4u * 2) << "then all of them try tiles";

    settings.pictures = 2;
    Renderer few(prepared, colors, settings);
    EXPECT_EQ(shadow(few.render()).reason, "so few runs end before culling could pay") << "all first runs of each band";
    EXPECT_EQ(shadow(few.render()).state_bytes, 0u);
}

// Programs take as long to compile as a sample takes to render.
TEST_F(RendererTest, MeteringNeedsNoProgramsOfItsOwn) {
    Scene dense = scene;  // triangles are large in the picture, and small in the one for metering
    add_ball(dense, add_material(dense, diffuse_material(vec3(0.5f))), vec3(0), 0.3f, 20);
    RenderSettings settings = small_settings(dense.cameras.front(), 160, 90, 1, 3);
    settings.aovs.clear();
    PreparedScene own(context, dense);
    ASSERT_GT(own.drawn_triangles(), kMeterPixels * kTracedTrianglesPerPixel);
    ASSERT_LT(own.drawn_triangles(), 160 * 90 * kTracedTrianglesPerPixel);
    Renderer(own, colors, settings).render();
    const std::size_t programs = own.programs().count();
    EXPECT_TRUE(find_exposure(own, colors, settings));
    EXPECT_EQ(own.programs().count(), programs);
}

// A viewer ends samples, and pictures of the samples so far, for the next view.
TEST_F(RendererTest, EndedWorkLeavesNoTrace) {
    struct Ended {};
    using enum Culling;
    // Earlier samples fill the radiance cache, so it is emptied before pictures are compared.
    for (const auto& [culling, cache] : {std::pair(off, false), {compute, false}, {raster, false}, {automatic, true}}) {
        RenderSettings settings = banded(culling);
        settings.aovs = {"albedo", "variance"};
        settings.preview = {.cache = cache, .filter = true};
        settings.in_turns = true;
        Renderer renderer(prepared, colors, settings);
        const auto render = [&](int last) {
            int points = 0;
            const Interruptible ends([&] {
                if (++points == last) throw Ended();
            });
            RenderResult result;
            renderer.render([&](const RenderProgress& p) {
                if (p.picture) result = p.picture({"albedo", "variance"});
                return true;
            });
            return std::pair(std::move(result), points);
        };
        const auto [expected, points] = render(0);
        EXPECT_GT(points, 100) << "of batches of rays and of passes of the filter";
        std::mt19937 random(3);
        for (int i = 0; i < 2; ++i) {
            const int last = 1 + static_cast<int>(random() % static_cast<unsigned>(points));
            SCOPED_TRACE(fmt::format("{}, ended at point {} of {}", rays::name(culling), last, points));
            EXPECT_THROW(render(last), Ended);
            if (cache) renderer.forget("camera cut");
            expect_same(render(0).first, expected);
        }
    }
}

TEST_F(RendererTest, AFailedUpdateRejectsFurtherUse) {
    Scene broken = scene;
    broken.instances[0].mesh = 99;
    Renderer own(context, scene, colors, banded(Culling::off));
    EXPECT_THROW(own.update(broken), Error);
    EXPECT_THROW(own.render(), Error);
    EXPECT_THROW(own.update(scene), Error);

    Renderer shared(prepared, colors, banded(Culling::off));
    EXPECT_THROW(prepared.update(broken), Error);
    EXPECT_THROW(shared.render(), Error);
    EXPECT_THROW(prepared.update(scene), Error);
    EXPECT_THROW(Renderer(prepared, colors, banded(Culling::off)), Error);
}

TEST_F(RendererTest, RasterCullingNeedsAPreparedScene) {
    PreparedScene bare(context, scene, {.raster_culling = false});
    EXPECT_THROW(Renderer(bare, colors, banded(Culling::raster)), Error);
    EXPECT_NO_THROW(Renderer(bare, colors, banded(Culling::compute)));
    Scene nothing = scene;
    nothing.instances.clear();
    PreparedScene empty(context, nothing, {.raster_culling = false});
    EXPECT_NO_THROW(Renderer(empty, colors, banded(Culling::raster)));
}

TEST_F(RendererTest, ScenesMayBeCutAndHaveASinglePose) {
    const RenderSettings settings = banded(Culling::automatic);
    const RenderResult whole = Renderer(prepared, colors, settings).render();
    bool read = false;
    PreparedScene cut(context, scene, {.most_in_part = 8, .single_pose = true, .scene_read = [&] { read = true; }});
    EXPECT_TRUE(read);
    EXPECT_GT(cut.hierarchies().built, prepared.hierarchies().built);
    EXPECT_THROW(cut.update(scene), Error);
    const RenderResult result = Renderer(cut, colors, settings).render();
    // Hits may move by a rounding if leaves have other boxes.
    std::size_t different = 0;
    for (std::size_t i = 0; i < whole.beauty.pixels.size(); ++i)
        different += std::abs(result.beauty.pixels[i] - whole.beauty.pixels[i]) > 1e-3f * whole.beauty.pixels[i];
    EXPECT_LE(different, whole.beauty.pixels.size() / 100);
}

TEST_F(RendererTest, RenderersShareAScene) {
    const RenderSettings settings = banded(Culling::compute);
    const std::vector<FrameSettings> all = frames(settings);
    Renderer alone(context, scene, colors, settings);
    const RenderResult expected[] = {alone.render(all[1]), alone.render(all[3])};
    EXPECT_GT(expected[0].stats.compile_seconds, 0);
    Renderer a(prepared, colors, settings), b(prepared, colors, settings);
    expect_same(a.render(all[1]), expected[0]);
    const RenderResult other = b.render(all[3]);
    EXPECT_EQ(other.stats.compile_seconds, 0) << "all programs are there";
    expect_same(other, expected[1]);
    expect_same(a.render(all[3]), expected[1]);
    expect_same(b.render(all[1]), expected[0]);
}

/// Returns a sheet under a white sky; the alpha of its texture removes one half.
Scene half_a_sheet(bool left) {
    Scene scene;
    const std::uint8_t l = left ? 255 : 0, r = left ? 0 : 255;
    scene.images = {{"mask", 2, 1, {255, 255, 255, l, 255, 255, 255, r}}};
    Material m = diffuse_material(vec3(0.25f));
    m.base_color_texture.image = 0;
    m.alpha_mode = AlphaMode::mask;
    add_quad(scene, add_material(scene, m), {-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
    scene.environment.color = vec3(1);
    scene.cameras = {look_at_camera({0, 0, 3}, {0, 0, 0}, {0, 1, 0}, 0.8)};
    return scene;
}

TEST_F(RendererTest, ScenesInBetweenChangeNothing) {
    for (const PrimaryVisibility primary : {PrimaryVisibility::raster, PrimaryVisibility::traced}) {
        SCOPED_TRACE(name(primary));
        const Scene left = half_a_sheet(true), right = half_a_sheet(false);
        RenderSettings settings = all_settings(left, 24, 16, 1);
        settings.primary = primary;
        Renderer a(context, left, colors, settings);
        const RenderResult first = a.render();
        Renderer b(context, right, colors, settings);
        EXPECT_FALSE(same_bits(first.beauty, b.render().beauty));
        expect_same(a.render(), first);
    }
}

TEST_F(RendererTest, ProgressCoversAllBands) {
    Renderer renderer(prepared, colors, banded(Culling::off));
    std::vector<int> done;
    renderer.render([&](const RenderProgress& p) {
        done.push_back(p.samples_done);
        return true;
    });
    EXPECT_EQ(done, (std::vector{0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3})) << "n/4 after each of 4 x 3 samples";

    int calls = 0;
    const RenderResult stopped = renderer.render([&](const RenderProgress&) { return ++calls < 5; });
    EXPECT_TRUE(stopped.stats.interrupted);
    EXPECT_EQ(stopped.stats.samples, 0) << "statistics of the last bands";
    const Image& samples = layer(stopped, "samples.Y");
    for (int y = 0; y < 60; ++y) EXPECT_EQ(*samples.at(20, y), y < 16 ? 3 : y < 32 ? 2 : 0) << y;
    EXPECT_EQ(stopped.stats.paths, 45u * 16 * (3 + 2));
    FrameSettings none = banded(Culling::off);
    none.samples = 0;
    EXPECT_THROW(renderer.render(none), Error);
}

}  // namespace
}  // namespace halflight::test
