// Tests techniques that differ only in noise: their means agree, and each reduces its own kind of noise.
#include <gtest/gtest.h>

#include "engine/core/error.h"
#include "renderer/pilot.h"
#include "tests/pass/rays/batches.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

constexpr int kSeeds = 16;

class EstimatorsTest : public GpuTest {
  protected:
    RenderResult picture(const Scene& scene, const Estimator& estimator, int samples, std::uint32_t seed = 1,
                         int bounces = 4) {
        RenderSettings settings = small_settings(scene.cameras.front(), 48, 48, samples, bounces);
        settings.estimator = estimator;
        settings.seed = seed;
        PreparedScene prepared(context, scene, {.estimator = estimator});
        find_estimator(prepared, ColorConfig::load(), settings);
        return Renderer(prepared, ColorConfig::load(), settings).render();
    }

    /// Statistics of independent pictures. Means are over blocks, because all pixels of a sample use the same point in
    /// the pixel, and pixels share paths.
    struct Layer {
        Batches blocks, pixels;
        void add(const Image& image) {
            blocks.add(block_means(image, 16));
            pixels.add(image);
        }
    };
    struct Layers {
        Layer direct, indirect, beauty;
    };
    Layers layers(const Scene& scene, const Estimator& estimator, int samples, std::uint32_t first_seed,
                  float filter_radius = 0.5f) {
        PreparedScene prepared(context, scene, {.estimator = estimator});
        RenderSettings settings = small_settings(scene.cameras.front(), 48, 48, samples, 4);
        settings.estimator = estimator;
        settings.filter.radius = filter_radius;
        Renderer renderer(prepared, ColorConfig::load(), settings);
        Layers all;
        for (std::uint32_t seed = 0; seed < kSeeds; ++seed) {
            settings.seed = first_seed + seed;
            const RenderResult r = renderer.render(settings);
            for (const BadValues& n : r.stats.bad_values) EXPECT_EQ(n.total(), 0u) << n.component;
            all.direct.add(layer(r, "direct_diffuse.R"));
            all.indirect.add(layer(r, "indirect_diffuse.R"));
            all.beauty.add(rgb(r.beauty));
        }
        return all;
    }
    /// Expects equal means of all layers.
    static void expect_equal_means(const std::string& name, Layers& a, Layers& b) {
        const Agreement limits{.p_value = 1e-5, .relative_difference = 0.01};
        for (const auto& [part, member] :
             {std::pair("-direct", &Layers::direct), {"-indirect", &Layers::indirect}, {"-beauty", &Layers::beauty}})
            EXPECT_TRUE(agree(name + part, (a.*member).blocks.estimate(), (b.*member).blocks.estimate(), limits));
    }
};

/// Returns slats between a varnished floor and three lights: a sun, a sky and a lamp. Every surface is lit by some of
/// them and shadowed from others.
Scene slats_in_the_sun() {
    Scene scene;
    Material floor = diffuse_material({0.7f, 0.6f, 0.5f});
    floor.clearcoat = 0.8f, floor.clearcoat_roughness = 0.3f;
    add_quad(scene, add_material(scene, floor), {-2, 0, -2}, {0, 0, 4}, {4, 0, 0});
    const int slat = add_material(scene, diffuse_material(vec3(0.6f)));
    for (int i = 0; i < 4; ++i) {
        const float x = -1.0f + 0.5f * static_cast<float>(i);
        add_box(scene, slat, {x, 0.3f, -1}, {x + 0.25f, 0.35f, 1});
    }
    scene.environment.color = {0.3f, 0.4f, 0.6f};
    PunctualLight sun;
    sun.type = LightType::directional;
    sun.intensity = {4, 3.6f, 3};
    sun.direction = glm::normalize(vec3(0.4f, -1, -0.3f));
    PunctualLight faint = sun, lamp = sun;
    faint.intensity = vec3(0.2f);
    faint.direction = glm::normalize(vec3(-1, -0.5f, 0));
    lamp.type = LightType::point;
    lamp.position = {0, 0.2, 0.3};
    lamp.intensity = vec3(0.1f);
    scene.lights = {faint, sun, lamp};
    scene.cameras = {look_at_camera({0.6, 1.2, 2}, {0, 0.1, 0}, {0, 1, 0}, 0.9)};
    return scene;
}

/// Returns slats between a lamp and a floor. Only the floor is in view, so there is no noise from edges.
Scene penumbra() {
    Scene scene;
    add_quad(scene, add_material(scene, diffuse_material(vec3(0.7f))), {-4, 0, -4}, {0, 0, 8}, {8, 0, 0});
    const int slat = add_material(scene, diffuse_material(vec3(0.5f)));
    for (const float x : {-0.5f, 0.1f}) add_box(scene, slat, {x, 0.5f, -1}, {x + 0.3f, 0.55f, 1});
    Material lamp = diffuse_material(vec3(0));
    lamp.emission = vec3(8);
    add_quad(scene, add_material(scene, lamp), {-0.3f, 1, -0.3f}, {0, 0, 0.6f}, {0.6f, 0, 0});
    scene.cameras = {look_at_camera({0, 0.45, 0}, {0, 0, 0}, {0, 0, -1}, 1.4)};
    return scene;
}

TEST_F(EstimatorsTest, SunApartHasTheSameMeanAndLessNoise) {
    const Scene scene = slats_in_the_sun();
    Layers among = layers(scene, {.lights = LightChoice::power, .sun = SunChoice::among}, 16, 1);
    const std::pair<LightChoice, Reuse> kWith[] = {
        {LightChoice::power, Reuse::off}, {LightChoice::power, Reuse::sixteen}, {LightChoice::all, Reuse::off}};
    for (const auto& [lights, reuse] : kWith) {
        Layers apart = layers(scene, {.lights = lights, .sun = SunChoice::apart, .reuse = reuse}, 16, 1001);
        const std::string with = std::string("sun-") + name(lights) + "-" + name(reuse);
        expect_equal_means(with, apart, among);
        EXPECT_LT(apart.direct.pixels.variance(), 0.5 * among.direct.pixels.variance()) << with;
        EXPECT_LT(apart.indirect.pixels.variance(), 0.8 * among.indirect.pixels.variance()) << with;
    }
}

// Large sizes, so that rays that leave the floor's varnish find much of the light.
TEST_F(EstimatorsTest, LightsWithASizeHaveOneMean) {
    Scene scene = slats_in_the_sun();
    scene.lights[0].angle = 0.5f, scene.lights[1].angle = 1.2f;
    scene.lights[2].radius = 0.15f;
    Layers power = layers(scene, {.lights = LightChoice::power, .sun = SunChoice::among}, 16, 1);
    const std::pair<const char*, Estimator> kOthers[] = {
        {"all, apart", {.lights = LightChoice::all, .sun = SunChoice::apart}},
        {"tree, among", {.lights = LightChoice::tree, .sun = SunChoice::among}},
        {"tree, apart, reuse", {.lights = LightChoice::tree, .sun = SunChoice::apart, .reuse = Reuse::sixteen}},
        {"four shadow rays", {.lights = LightChoice::power, .sun = SunChoice::among, .shadow = ShadowRays::four}}};
    for (const auto& [name, estimator] : kOthers) {
        Layers other = layers(scene, estimator, 16, 1001);
        expect_equal_means(std::string("sizes, ") + name, other, power);
    }
}

TEST_F(EstimatorsTest, ASingleSunIsSampledAsBefore) {
    Scene scene = slats_in_the_sun();
    scene.environment.color = vec3(0);
    scene.lights = {scene.lights[1]};
    const Image apart = picture(scene, {.sun = SunChoice::apart}, 4).beauty;
    EXPECT_TRUE(same_bits(apart, picture(scene, {.sun = SunChoice::among}, 4).beauty));
    EXPECT_FALSE(same_bits(apart, Image(apart.width, apart.height, apart.channels)));
}

TEST_F(EstimatorsTest, ExtraCameraRaysExtendTheSequence) {
    Scene scene = cornell_box();
    scene.cameras = {look_at_camera({0, 0.3, 0.9}, {0, 0.98, 0}, {0, 0, -1}, 1.2)};  // the camera sees the lamp's edges
    const RenderResult four = picture(scene, {.camera = CameraRays::four}, 4);
    const RenderResult one = picture(scene, {.camera = CameraRays::one}, 4);
    const RenderResult longer = picture(scene, {.camera = CameraRays::one}, 16);
    const Image &emission = layer(four, "emission.R"), &as_many = layer(longer, "emission.R");
    int edges = 0;
    for (std::size_t i = 0; i < emission.pixels.size(); ++i) {
        ASSERT_NEAR(emission.pixels[i], as_many.pixels[i], 1e-5f * as_many.pixels[i]) << i;
        edges += as_many.pixels[i] > 0 && layer(one, "emission.R").pixels[i] != as_many.pixels[i];
    }
    EXPECT_GT(edges, 20) << "the test has no power";
    for (const char* other : {"direct_diffuse.R", "indirect_diffuse.R"})
        EXPECT_TRUE(same_bits(layer(four, other), layer(one, other))) << other;
    for (std::size_t i = 3; i < four.beauty.pixels.size(); i += 4)
        ASSERT_EQ(four.beauty.pixels[i], one.beauty.pixels[i]) << "coverage";
    EXPECT_TRUE(same_bits(picture(scene, {}, 4).beauty, one.beauty)) << "unless requested";
}

TEST_F(EstimatorsTest, ShadowRaysOfOnePathShareItsDirectLight) {
    const auto compare = [&](const Scene& scene, const std::string& name) {
        Layers one = layers(scene, {}, 8, 1), four = layers(scene, {.shadow = ShadowRays::four}, 8, 1001);
        expect_equal_means(name, four, one);
        return four.direct.pixels.variance() / one.direct.pixels.variance();
    };
    compare(slats_in_the_sun(), "slats");
    EXPECT_LT(compare(penumbra(), "penumbra"), 0.4);
    const Scene scene = slats_in_the_sun();
    EXPECT_TRUE(same_bits(layer(picture(scene, {.shadow = ShadowRays::eight}, 4), "indirect_diffuse.R"),
                          layer(picture(scene, {}, 4), "indirect_diffuse.R")));
}

TEST_F(EstimatorsTest, APilotDecidesTheAutomaticTechniques) {
    const Estimator open{.reuse = Reuse::automatic, .camera = CameraRays::automatic, .shadow = ShadowRays::automatic};
    Scene scene = cornell_box();
    scene.cameras = {look_at_camera({0, 0.3, 0.9}, {0, 0.98, 0}, {0, 0, -1}, 1.2)};  // the camera sees the lamp's edges
    const RenderResult piloted = picture(scene, open, 4);
    const Estimator found = piloted.stats.estimator;
    EXPECT_FALSE(leaves_open(found));
    EXPECT_GT(found.camera, CameraRays::one);
    EXPECT_TRUE(same_bits(piloted.beauty, picture(scene, found, 4).beauty)) << "as if it had been requested";
    EXPECT_EQ(picture(scene, open, 4, 2).stats.estimator, found) << "whatever the seed";

    PreparedScene prepared(context, scene, {.estimator = open});
    const Estimator before = prepared.estimator();
    RenderSettings settings = small_settings(scene.cameras.front(), 48, 48, 4, 4);
    EXPECT_THROW(Renderer(prepared, ColorConfig::load(), settings), Error) << "which runs no pilot by itself";
    double share = 0;
    EXPECT_FALSE(find_estimator(prepared, ColorConfig::load(), settings, [&](double s) { return (share = s) < 0.5; }));
    EXPECT_GE(share, 0.5);
    EXPECT_EQ(prepared.estimator(), before) << "cancelled";
    EXPECT_TRUE(find_estimator(prepared, ColorConfig::load(), settings));
    EXPECT_EQ(prepared.estimator(), found) << "as for any other renderer";
    EXPECT_EQ(prepared.asked_estimator(), open);
    settings.camera = look_at_camera({0, 0, 0.9}, {0, -0.98, 0}, {0, 0, -1}, 1.2);  // this camera sees the floor
    EXPECT_EQ(Renderer(prepared, ColorConfig::load(), settings).render().stats.estimator, found);

    scene.cameras = {settings.camera};
    const RenderStats floor = picture(scene, open, 4).stats;
    EXPECT_EQ(floor.estimator.camera, CameraRays::one);
    const auto fact = std::ranges::find(floor.left_out, "camera rays for light alone", &LeftOut::what);
    ASSERT_NE(fact, floor.left_out.end());
    EXPECT_EQ(fact->fact, "a pilot found that it does not pay");
}

/// The denoiser leaves emission as it is, so edges of emitters cause a larger share of the error.
TEST_F(EstimatorsTest, APilotCountsLessNoiseThatIsFiltered) {
    const Scene scene = cornell_box();
    RenderSettings settings = small_settings(scene.cameras.front(), 48, 48, 4, 4);
    const auto found = [&](bool denoise) {
        settings.denoise = denoise;
        PreparedScene prepared(context, scene, {.estimator = {.camera = CameraRays::automatic}});
        find_estimator(prepared, ColorConfig::load(), settings);
        return prepared.estimator().camera;
    };
    EXPECT_GT(found(true), found(false));
}

TEST_F(EstimatorsTest, IndependentSamplesConvergeAtTheirRate) {
    const Scene scene = slats_in_the_sun();
    const Estimator independent{.sampler = SamplePoints::independent};
    Layers few = layers(scene, independent, 4, 1), many = layers(scene, independent, 64, 101);
    Layers sobol = layers(scene, {}, 64, 201);
    expect_equal_means("independent", many, sobol);
    EXPECT_NEAR(few.beauty.pixels.variance() / many.beauty.pixels.variance(), 16, 3);
    EXPECT_LT(sobol.beauty.pixels.variance(), 0.8 * many.beauty.pixels.variance());
    EXPECT_FALSE(same_bits(picture(scene, independent, 1, 1).beauty, picture(scene, independent, 1, 2).beauty));
}

TEST_F(EstimatorsTest, BlueNoiseCancelsBetweenPixels) {
    const Scene scene = penumbra();
    // Size of the point light. All pixels use the same point in the pixel, so its errors are equal.
    constexpr float kPoint = 0.0101f;
    for (const int samples : {1, 4}) {
        Layers sobol = layers(scene, {}, samples, 1, kPoint);
        Layers blue = layers(scene, {.sampler = SamplePoints::blue_noise}, samples, 101, kPoint);
        expect_equal_means("blue-noise", blue, sobol);
        EXPECT_NEAR(blue.beauty.pixels.variance() / sobol.beauty.pixels.variance(), 1, 0.1) << samples;
        // In later samples most noise comes from the interaction of many dimensions, which no pixel order can improve.
        if (samples > 1) continue;
        EXPECT_LT(blue.direct.blocks.variance(), 0.5 * sobol.direct.blocks.variance());
    }
}

TEST_F(EstimatorsTest, BlueNoiseIsUsedForKnownSmallSampleCounts) {
    const Scene scene = slats_in_the_sun();
    const auto rendered = [&](SamplePoints points, const auto& change) {
        RenderSettings settings = small_settings(scene.cameras.front(), 16, 16, 2, 2);
        settings.estimator.sampler = points;
        change(settings);
        return render(context, scene, settings).beauty;
    };
    const auto differs = [&](const auto& change) {
        return !same_bits(rendered(SamplePoints::blue_noise, change), rendered(SamplePoints::sobol, change));
    };
    EXPECT_TRUE(differs([](RenderSettings&) {}));
    EXPECT_TRUE(differs([](RenderSettings& s) { s.samples = kMostBlueNoiseSamples; }));
    EXPECT_FALSE(differs([](RenderSettings& s) { s.samples = kMostBlueNoiseSamples + 1; }));
    EXPECT_FALSE(differs([](RenderSettings& s) { s.first_sample = 2; }));
    EXPECT_FALSE(differs([](RenderSettings& s) { s.time_limit = 1e6; }));
    EXPECT_TRUE(differs([](RenderSettings& s) { s.first_sample = 2, s.of_samples = 4; })) << "share of a few samples";
    EXPECT_FALSE(differs([](RenderSettings& s) { s.error = ErrorTarget{ErrorMetric::relmse, 1e3}, s.samples = 16; }));
}

}  // namespace
}  // namespace halflight::test
