// Tests --denoise through the renderer: smaller errors, an unbiased mean beside the picture, equal bits whatever the
// schedule.
#include <gtest/gtest.h>

#include <algorithm>

#include "engine/io/gltf/gltf.h"
#include "renderer/frame_constants.h"
#include "renderer/held_out.h"
#include "tests/pass/picture/cornell_test.h"

namespace halflight::test {
namespace {

class DenoisedPictureTest : public CornellTest {
  protected:
    RenderSettings settings_of(const Scene& scene, int width, int height, int samples) {
        RenderSettings s = small_settings(scene.cameras[0], width, height, samples, 3);
        s.aovs.insert(s.aovs.end(), {"noisy", "denoiser", "samples"});
        return s;
    }
    RenderResult render(PreparedScene& prepared, const RenderSettings& settings, bool denoise = true) {
        RenderSettings s = settings;
        s.denoise = denoise;
        return Renderer(prepared, colors, s).render();
    }
    /// Renders a reference with other random numbers.
    Image reference_of(PreparedScene& prepared, RenderSettings settings, int samples) {
        settings.samples = samples, settings.seed = 5;
        return render(prepared, settings, false).beauty;
    }
    static void expect_light_kept(const Image& denoised, const Image& plain, double tolerance) {
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(mean_of_pixels(denoised, c).value / mean_of_pixels(plain, c).value, 1, tolerance) << c;
    }
};

TEST_F(DenoisedPictureTest, ItsErrorIsEstimatedFromOtherSamples) {
    RenderSettings settings = small_settings(cornell.cameras[0], 64, 48, 256, 3);
    Image truth[2];
    for (const std::uint32_t half : {0u, 1u}) {
        settings.seed = 100 + half;
        truth[half] = rgb(render(prepared_cornell, settings, false).beauty);
    }
    settings.denoise = true;
    settings.denoise_error = 16;
    int inside = 0;
    constexpr int kSeeds = 12;
    Renderer renderer(prepared_cornell, colors, settings);
    const auto further = [&](const FrameSettings& frame, const ProgressCallback& progress) {
        return renderer.render(frame, progress);
    };
    for (std::uint32_t seed = 0; seed < kSeeds; ++seed) {
        settings.samples = 8, settings.seed = seed;
        RenderResult result = renderer.render(settings);
        const Image before = result.beauty;
        estimate_denoised_error(settings, result, further, {});
        ASSERT_TRUE(result.stats.denoised_error);
        EXPECT_EQ(result.beauty.pixels, before.pixels);
        const ErrorEstimate& e = result.stats.denoised_error->estimate;
        const double exact = held_out_error(result.beauty, truth[0], truth[1], ErrorMetric::relmse).value;
        inside += e.lower <= exact && exact <= e.upper;
        EXPECT_LT(e.upper, 0.2);
    }
    EXPECT_GE(inside, 9) << "fewer than 9 of 12 have a probability of 1 in 4000 at 95 %";

    settings.samples = 1;  // cannot be denoised
    RenderResult one = renderer.render(settings);
    estimate_denoised_error(settings, one, further, {});
    EXPECT_FALSE(one.stats.denoised_error);
    settings.samples = 8;
    RenderResult stopped = renderer.render(settings);
    estimate_denoised_error(settings, stopped, further, [](const RenderProgress& p) {
        EXPECT_EQ(p.samples_total, 8 + 2 * 16);
        return p.samples_done < 20;
    });
    EXPECT_TRUE(stopped.stats.interrupted);
    EXPECT_FALSE(stopped.stats.denoised_error);
}

TEST_F(DenoisedPictureTest, ItsErrorIsSmallerAndTheRestStays) {
    RenderSettings settings = settings_of(cornell, 64, 48, 8);
    const RenderResult plain = render(prepared_cornell, settings, false), denoised = render(prepared_cornell, settings);
    EXPECT_FALSE(same_bits(plain.beauty, denoised.beauty));
    EXPECT_TRUE(same_bits(layer(denoised, "noisy.R"), rgb(plain.beauty)));
    EXPECT_TRUE(same_bits(layer(plain, "noisy.R"), rgb(plain.beauty)));
    for (const char* own : {"emission.R", "direct_diffuse.R", "indirect_glossy.R", "variance.R"})
        EXPECT_TRUE(same_bits(layer(plain, own), layer(denoised, own))) << own;
    EXPECT_TRUE(plain.stats.biases.empty());
    ASSERT_EQ(denoised.stats.biases.size(), 1u);
    EXPECT_TRUE(denoised.stats.biases[0].starts_with("denoised: ")) << denoised.stats.biases[0];
    EXPECT_TRUE(denoised.stats.layer_biases.empty());
    for (const float weight : layer(plain, "denoiser.glossy").pixels) ASSERT_EQ(weight, 0);
    const Image& weights = layer(denoised, "denoiser.glossy");
    EXPECT_GT(mean_of_pixels(weights, 0).value, 0.3);
    for (const float weight : weights.pixels) ASSERT_TRUE(weight >= 0 && weight <= 1) << weight;

    const Image reference = reference_of(prepared_cornell, settings, 512);
    EXPECT_LT(relative_error(denoised.beauty, reference), 0.25 * relative_error(plain.beauty, reference));
    expect_light_kept(denoised.beauty, plain.beauty, 0.02);
}

/// Returns a Cornell box without blocks whose back wall is a mirror, or a sheet of white paper, and whose floor has
/// stripes.
Scene striped_cornell(bool mirror) {
    Scene scene = cornell_box();
    scene.instances.resize(6);
    const int back = add_material(scene, mirror ? metal_material(vec3(0.9f), 0) : diffuse_material(vec3(0.9f)));
    add_quad(scene, back, {-0.95f, -0.95f, -0.95f}, {1.9f, 0, 0}, {0, 1.9f, 0});
    const int stripe = add_material(scene, diffuse_material(vec3(0.2f)));
    for (int i = 0; i < 12; ++i)
        add_quad(scene, stripe, {-1 + static_cast<float>(i) / 6, -0.999f, -1}, {0, 0, 2}, {1.0f / 12, 0, 0});
    return scene;
}

TEST_F(DenoisedPictureTest, BlurredTexturesKeepNoNoise) {
    // The stripes are far out of focus, and a pixel's samples meet both colours. Light has little noise of its own.
    Scene scene;
    scene.environment.color = vec3(1);
    for (int i = 0; i < 64; ++i) {
        const int stripe = add_material(scene, diffuse_material(vec3(i % 2 == 0 ? 0.8f : 0.1f)));
        add_quad(scene, stripe, {-4 + static_cast<float>(i) / 8, 0, -8}, {0, 0, 16}, {1.0f / 8, 0, 0});
    }
    scene.cameras = {look_at_camera({0, 2, 3}, {0, 0, 0}, {0, 1, 0}, 0.5)};
    PreparedScene prepared(context, scene);
    RenderSettings settings = settings_of(scene, 64, 64, 8);
    settings.camera.lens = {.aperture = 600, .focus = {.kind = Focus::Kind::distance, .distance = 1.5}};
    const RenderResult plain = render(prepared, settings, false), denoised = render(prepared, settings);
    const Image reference = reference_of(prepared, settings, 512);
    EXPECT_LT(10 * relative_error(denoised.beauty, reference), relative_error(plain.beauty, reference))
        << "where albedos are not smoothed, the gain is about 1";
    expect_light_kept(denoised.beauty, plain.beauty, 0.02);
}

TEST_F(DenoisedPictureTest, DarkSaturatedColoursKeepTheirHue) {
    // Features hardly tell the stripes apart, so that each takes light of the other. In a channel in which one of them
    // reflects next to nothing, its light over albedo must be that of the other all the same.
    Scene scene;
    scene.environment.color = vec3(1);
    const vec3 colors_of[] = {{0.003f, 0.11f, 0.18f}, {0.03f, 0.16f, 0.004f}};
    for (int i = 0; i < 16; ++i) {
        const int stripe = add_material(scene, diffuse_material(colors_of[i % 2]));
        add_quad(scene, stripe, {-4 + static_cast<float>(i) / 2, -4, 0}, {0.5f, 0, 0}, {0, 8, 0});
    }
    add_box(scene, add_material(scene, diffuse_material(vec3(0))), {-1, -1, 0.25f}, {1, 1, 0.5f});
    scene.cameras = {look_at_camera({0, 0, 10}, {0, 0, 0}, {0, 1, 0}, 0.7)};
    PreparedScene prepared(context, scene);
    RenderSettings settings = settings_of(scene, 96, 96, 16);
    settings.aovs.emplace_back("albedo");
    const RenderResult denoised = render(prepared, settings);
    const Image albedo = layer(denoised, "albedo.R"), noisy = layer(denoised, "noisy.R");
    dvec3 kept(0), before(0);
    for (const Pixel p : pixels_of(ivec2(96))) {
        if (albedo.at(p.x, p.y)[2] < 0.179f) continue;  // pixels of the first colour alone
        for (int c = 0; c < 3; ++c) kept[c] += denoised.beauty.at(p.x, p.y)[c], before[c] += noisy.at(p.x, p.y)[c];
    }
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(kept[c] / before[c], 1, 0.01) << c;
}

/// A picture that lacks bands stays the mean; nothing of the picture before shows.
TEST_F(DenoisedPictureTest, PicturesThatLackBandsStayNoisy) {
    RenderSettings settings = settings_of(cornell, 64, 64, 8);
    settings.band_pixels = 64 * 32;
    settings.denoise = true;
    Renderer renderer(prepared_cornell, colors, settings);
    EXPECT_TRUE(renderer.render(settings).stats.denoised);
    settings.seed = 77;
    const RenderResult stopped = renderer.render(settings, [](const RenderProgress& p) { return p.samples_done < 2; });
    EXPECT_TRUE(stopped.stats.interrupted);
    EXPECT_FALSE(stopped.stats.denoised);
    EXPECT_TRUE(same_bits(rgb(stopped.beauty), layer(stopped, "noisy.R")));
    EXPECT_EQ(stopped.beauty.at(32, 60)[0], 0);
}

TEST_F(DenoisedPictureTest, HighlightsKeepTheirLight) {
    // Small lamps behind the camera are reflected by rough metal balls, where few samples meet a lamp. The lens spreads
    // these highlights over discs.
    Scene scene;
    scene.environment.color = vec3(0.05f);
    const int metal = add_material(scene, metal_material(vec3(0.9f), 0.15f));
    for (int i = 0; i < 3; ++i) add_smooth_ball(scene, metal, {-1.1f + 1.1f * static_cast<float>(i), 0, 0}, 0.5f, 16);
    const int lamp = add_material(scene, light_material(vec3(400)));
    for (int i = 0; i < 3; ++i)
        add_quad(scene, lamp, {-2 + 2 * static_cast<float>(i), 2.5f, 3}, {0.1f, 0, 0}, {0, 0, 0.1f});
    scene.cameras = {look_at_camera({0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 0.6)};
    PreparedScene prepared(context, scene);
    RenderSettings settings = settings_of(scene, 96, 64, 8);
    const auto kept = [&] {
        double light = 0, noisy_light = 0;
        for (settings.seed = 3; settings.seed < 7; ++settings.seed) {
            const RenderResult denoised = render(prepared, settings);
            for (int c = 0; c < 3; ++c) {
                light += mean_of_pixels(denoised.beauty, c).value;
                noisy_light += mean_of_pixels(layer(denoised, "noisy.R"), c).value;
            }
        }
        return light / noisy_light;
    };
    EXPECT_NEAR(kept(), 1, 0.005) << "sharp highlights";
    settings.camera.lens = {.aperture = 300, .focus = {.kind = Focus::Kind::distance, .distance = 1.5}};
    EXPECT_NEAR(kept(), 1, 0.01) << "blurred highlights";
}

TEST_F(DenoisedPictureTest, DimRoomsKeepFewBlotches) {
    // Few paths find the light of the room. Pictures with other seeds tell the noise that is left.
    const Scene scene = load_gltf(HALFLIGHT_SOURCE_DIR "/scenes/room.glb");
    PreparedScene prepared(context, scene);
    RenderSettings settings = settings_of(scene, 240, 160, 8);
    const Image one = rgb(render(prepared, settings).beauty);
    settings.seed = 4;
    const Image two = rgb(render(prepared, settings).beauty);
    std::vector<double> apart;
    for (std::size_t i = 0; i < one.pixels.size(); ++i)
        apart.push_back(std::abs(double(one.pixels[i]) - double(two.pixels[i])) / (double(one.pixels[i]) + 0.05));
    const auto most = apart.begin() + std::ptrdiff_t(apart.size() / 10 * 9);
    std::ranges::nth_element(apart, most);
    EXPECT_LT(*most, 0.215) << "0.24 with narrow filters and insignificant shares";
}

TEST_F(DenoisedPictureTest, MirrorImagesStaySharp) {
    const Scene scene = striped_cornell(true);
    PreparedScene prepared(context, scene);
    RenderSettings settings = settings_of(scene, 96, 96, 4);
    const RenderResult plain = render(prepared, settings, false), denoised = render(prepared, settings);
    EXPECT_TRUE(same_bits(layer(denoised, "noisy.R"), rgb(plain.beauty)));
    const Image reference = reference_of(prepared, settings, 256);
    const auto error_of = [&](const Image& image, int first_row, int end_row) {
        const ivec2 first(28, first_row), size(40, end_row - first_row);
        return mean_of(squared_error_map(part_of(rgb(image), first, size), part_of(rgb(reference), first, size)));
    };
    // Without chains, the two ratios are 200 and 0.08.
    EXPECT_LT(error_of(denoised.beauty, 56, 66), 3 * error_of(plain.beauty, 56, 66)) << "the dark behind the camera";
    EXPECT_LT(error_of(denoised.beauty, 69, 76), 0.05 * error_of(plain.beauty, 69, 76)) << "the stripes";
}

TEST_F(DenoisedPictureTest, ChainsOfScenesWithoutMirrorsChangeNothing) {
    const Scene scene = striped_cornell(false), shiny = shiny_cornell();
    for (const Scene* each : {&scene, &shiny}) {
        RenderSettings settings = settings_of(*each, 48, 32, 4);
        settings.denoise = true;
        const RenderResult lean = halflight::test::render(context, *each, settings);
        settings.kept = Kept({"surfaces seen in mirrors"});
        const RenderResult kept = halflight::test::render(context, *each, settings);
        EXPECT_TRUE(std::ranges::any_of(lean.stats.left_out, [](const LeftOut& part) {
            return part.what == "surfaces seen in mirrors" && part.fact == "no lobe has a roughness of 0.1 or less";
        }));
        expect_same(kept, lean);
    }
}

TEST_F(DenoisedPictureTest, OneSampleStaysAsItIs) {
    RenderSettings settings = settings_of(cornell, 33, 20, 1);
    const RenderResult denoised = render(prepared_cornell, settings);
    EXPECT_TRUE(same_bits(denoised.beauty, render(prepared_cornell, settings, false).beauty));
    EXPECT_TRUE(denoised.stats.biases.empty());
    settings.width = settings.height = 1;
    for (const int samples : {1, 2, 3}) {
        settings.samples = samples;
        const Image picture = render(prepared_cornell, settings).beauty;
        for (const float value : picture.pixels) EXPECT_TRUE(std::isfinite(value) && value >= 0);
    }
    settings.bounces = 0;
    EXPECT_TRUE(render(prepared_cornell, settings).stats.biases.empty()) << "emission is not filtered";
}

TEST_F(DenoisedPictureTest, IsEqualInBandsAndInTurns) {
    RenderSettings settings = settings_of(cornell, 45, 60, 6);
    settings.want_view = true;
    const RenderResult whole = render(prepared_cornell, settings);
    EXPECT_TRUE(same_bits(whole.view, colors.view({}).apply(whole.beauty))) << "the view is another picture's";
    settings.band_pixels = 48 * 16;
    expect_same(render(prepared_cornell, settings), whole);
    settings.in_turns = true, settings.denoise = true;
    Renderer in_turns(prepared_cornell, colors, settings);
    std::vector<RenderResult> seen;
    expect_same(in_turns.render([&](const RenderProgress& progress) {
        if (progress.picture && progress.samples_done == 3) seen.push_back(progress.picture(settings.aovs));
        return true;
    }),
                whole);
    ASSERT_FALSE(seen.empty());
    settings.samples = 3;
    expect_same(seen.back(), render(prepared_cornell, settings));
}

TEST_F(DenoisedPictureTest, ErrorTargetsReferToTheMean) {
    RenderSettings settings = settings_of(cornell, 32, 24, 64);
    settings.error = ErrorTarget{.error = 1e-6};
    const RenderResult plain = render(prepared_cornell, settings, false), denoised = render(prepared_cornell, settings);
    ASSERT_TRUE(plain.stats.error && denoised.stats.error);
    EXPECT_EQ(plain.stats.error->estimate.value, denoised.stats.error->estimate.value);
    EXPECT_EQ(plain.stats.error->estimate.bound, denoised.stats.error->estimate.bound);
    EXPECT_TRUE(same_bits(layer(denoised, "noisy.R"), rgb(plain.beauty)));
    EXPECT_FALSE(same_bits(denoised.beauty, plain.beauty));
}

TEST(Halves, AreEqualAtPowersOfTwo) {
    int first = 0;
    for (std::uint32_t n = 0; n < 1024; ++n) {
        const bool power = n > 1 && (n & (n - 1)) == 0;
        EXPECT_TRUE(!power || 2 * first == static_cast<int>(n)) << n;
        first += in_first_half(n) ? 1 : 0;
        const int all = static_cast<int>(n) + 1;
        EXPECT_TRUE(all < 2 || (3 * first >= all && 3 * first <= 2 * all + 1)) << n;
    }
}

}  // namespace
}  // namespace halflight::test
