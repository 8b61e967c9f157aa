// Tests shadow catchers: alpha is the share of their direct light that the other objects block, and exactly 0 where
// they block none.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/core/statistics.h"
#include "engine/io/gltf/gltf.h"
#include "tests/pass/rays/batches.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

const vec3 kSky = {0.3f, 0.4f, 0.6f};

/// Returns a floor of 8 x 8 that catches shadows.
Scene floor_of_shadows() {
    Scene scene;
    add_quad(scene, add_material(scene, metal_material({0.1f, 0.2f, 0.1f}, 0.1f)), {-4, 0, -4}, {0, 0, 8}, {8, 0, 0});
    scene.instances[0].catcher = true;
    return scene;
}

/// Adds a lamp 2 above the floor, and a square of 1 x 1 that hangs half as high. Its umbra is [-1, 1] x [-1, 1].
Scene square_under_a_lamp() {
    Scene scene = floor_of_shadows();
    add_quad(scene, add_material(scene, diffuse_material({0.9f, 0.1f, 0.1f})), {-0.5f, 1, -0.5f}, {0, 0, 1}, {1, 0, 0});
    PunctualLight& lamp = scene.lights.emplace_back();
    lamp.position = {0, 2, 0};
    lamp.intensity = vec3(5);
    return scene;
}

/// Returns settings for a view of the floor from which the square does not hide the spot.
RenderSettings spot(double x, double z, double size, int samples = 4) {
    RenderSettings settings = small_settings(spot_camera({x, 0, z}, {0.3, 0.5, 0.6}, size), 16, 16, samples, 3);
    settings.transparent = true;
    settings.aovs.clear();
    return settings;
}

/// Returns a view of the square, the floor and the borders of the shadow.
RenderSettings wide(int samples = 4) {
    RenderSettings settings = spot(0, 0, 4, samples);
    settings.camera = look_at_camera({1, 2.2, 3}, {0, 0.3, 0}, {0, 1, 0}, 0.9);
    return settings;
}

void expect_all(const Image& image, int channel, float value) {
    for (std::size_t i = static_cast<std::size_t>(channel); i < image.pixels.size(); i += 4)
        ASSERT_EQ(image.pixels[i], value) << "pixel " << i / 4;
}

Image alpha_of(const Image& image) {
    Image alpha(image.width, image.height, 3);
    for (std::size_t i = 0; i < alpha.pixels.size(); ++i) alpha.pixels[i] = image.pixels[i / 3 * 4 + 3];
    return alpha;
}

class ShadowCatcher : public GpuTest {
  protected:
    Image beauty(const Scene& scene, const RenderSettings& settings) {
        const RenderResult result = render(context, scene, settings);
        for (const BadValues& n : result.stats.bad_values) EXPECT_EQ(n.total(), 0u) << n.component;
        return result.beauty;
    }
};

TEST_F(ShadowCatcher, UmbraHasAlpha1AndTheRest0) {
    const Scene scene = square_under_a_lamp();
    const Image umbra = beauty(scene, spot(0.3, 0.3, 0.5));
    const Image lit = beauty(scene, spot(1.5, 1.5, 0.5));
    expect_all(umbra, 3, 1);
    expect_all(lit, 3, 0);
    for (int c = 0; c < 3; ++c) expect_all(umbra, c, 0), expect_all(lit, c, 0);
}

TEST_F(ShadowCatcher, HasTheOccludedShareOfASky) {
    // A ball above the horizon takes the share r^2 h / d^3 from the irradiance of a constant sky, d from its centre.
    Scene scene = floor_of_shadows();
    add_smooth_ball(scene, add_material(scene, diffuse_material(vec3(0.5f))), {0, 0.5f, 0}, 0.3f, 48);
    scene.environment.color = kSky;
    RenderSettings settings = spot(0, 0, 0.01, 64);
    settings.camera = spot_camera({0.4, 0, 0}, {1, 1, 0}, 0.01);
    const MeanValue alpha = mean_of_pixels(alpha_of(beauty(scene, settings)), 0);
    EXPECT_NEAR(alpha.value, 0.09 * 0.5 / std::pow(0.41, 1.5), 4 * alpha.error + 0.003);
    EXPECT_LT(alpha.error, 0.003);
    scene.instances[1].object_to_world[3].y = 100;
    expect_all(beauty(floor_of_shadows(), settings), 3, 0);
}

TEST_F(ShadowCatcher, PenumbraIsThatOfThePicturesWithAndWithoutTheObject) {
    Scene scene = square_under_a_lamp();
    scene.lights.clear();
    add_quad(scene, add_material(scene, light_material(vec3(4))), {-0.3f, 2, -0.3f}, {0.6f, 0, 0}, {0, 0, 0.6f});
    scene.materials[0] = diffuse_material(vec3(0.5f));
    Scene plain = scene;
    plain.instances[0].catcher = false;
    Scene without = plain;
    without.instances.erase(without.instances.begin() + 1);
    RenderSettings settings = spot(0.9, 0.2, 0.8, 16);
    settings.bounces = 1;
    Batches caught, blocked;
    for (settings.seed = 0; settings.seed < 6; ++settings.seed) {
        RenderSettings own = settings, other = settings;
        own.seed += 100, other.seed += 200;
        Image alpha = alpha_of(beauty(scene, settings));
        const Image light = rgb(beauty(without, own));
        for (std::size_t i = 0; i < alpha.pixels.size(); ++i) alpha.pixels[i] *= light.pixels[i];
        Image lacks = rgb(beauty(without, other));
        const Image lit = rgb(beauty(plain, other));
        for (std::size_t i = 0; i < lacks.pixels.size(); ++i) lacks.pixels[i] -= lit.pixels[i];
        EXPECT_GT(*std::ranges::max_element(lacks.pixels), 5 * *std::ranges::min_element(lacks.pixels));
        caught.add(block_means(alpha, 8)), blocked.add(block_means(lacks, 8));
    }
    EXPECT_TRUE(agree("shadow-catcher", caught.estimate(), blocked.estimate(), {.p_value = 1e-5}));
}

TEST_F(ShadowCatcher, DarkensAVisibleEnvironment) {
    Scene scene = square_under_a_lamp();
    scene.environment.color = kSky;
    RenderSettings settings = spot(1, 0.3, 1);
    const Image alpha = beauty(scene, settings);
    settings.transparent = false;
    const Image over = beauty(scene, settings);
    for (std::size_t i = 0; i < over.pixels.size(); i += 4) {
        for (std::size_t c = 0; c < 3; ++c)
            EXPECT_NEAR(over.pixels[i + c], kSky[int(c)] * (1 - alpha.pixels[i + 3]), 1e-6f);
        EXPECT_EQ(over.pixels[i + 3], 1);
    }
}

TEST_F(ShadowCatcher, CatchesNoShadowsOfCatchers) {
    Scene scene = square_under_a_lamp();
    scene.instances[1].catcher = true;
    scene.environment.color = kSky;
    for (const double x : {0.3, 1.0}) expect_all(beauty(scene, spot(x, 0.3, 0.5)), 3, 0);
}

TEST_F(ShadowCatcher, IsSeenByOtherRaysAsItIs) {
    Scene scene = square_under_a_lamp();
    scene.materials[1] = metal_material(vec3(0.9f), 0);
    scene.environment.color = kSky;
    RenderSettings settings = spot(0, 0, 0.5);
    settings.camera = spot_camera({0, 1, 0}, {0.3, -0.5, 0.6}, 0.5);  // the square from below, which shows the floor
    settings.camera.camera_to_world[3] = dvec4(0.3, 0.5, 0.6, 1);
    Scene plain = scene;
    plain.instances[0].catcher = false;
    EXPECT_EQ(beauty(scene, settings).pixels, beauty(plain, settings).pixels);
}

TEST_F(ShadowCatcher, StandsBesideAllMaterials) {
    Scene scene = load_gltf(HALFLIGHT_SOURCE_DIR "/scenes/still-life.glb");
    for (Instance& instance : scene.instances)
        instance.catcher = scene.meshes[std::size_t(instance.mesh)].name == "table";
    RenderSettings settings = small_settings(scene.cameras.front(), 32, 18, 4, 2);
    settings.transparent = true;
    const Image picture = beauty(scene, settings);
    int shadows = 0;
    for (std::size_t i = 0; i < picture.pixels.size(); i += 4) {
        const float* const p = &picture.pixels[i];
        shadows += p[0] == 0 && p[1] == 0 && p[2] == 0 && p[3] > 0.01f && p[3] < 0.99f;
    }
    EXPECT_GT(shadows, 20);
}

TEST_F(ShadowCatcher, DoesNotDependOnBandsOrTracers) {
    const Scene scene = square_under_a_lamp();
    RenderSettings settings = wide();
    settings.width = settings.height = 48;
    const Image whole = beauty(scene, settings);
    RenderSettings bands = settings;
    bands.band_pixels = 48 * 16;
    EXPECT_EQ(beauty(scene, bands).pixels, whole.pixels);
    bands.in_turns = true;
    EXPECT_EQ(beauty(scene, bands).pixels, whole.pixels) << "each band has sums of its own";
    for (const rays::Culling culling : {rays::Culling::off, rays::Culling::compute}) {
        settings.culling = culling;
        EXPECT_EQ(beauty(scene, settings).pixels, whole.pixels);
    }
}

TEST_F(ShadowCatcher, KeepsAlphaWhereThePictureIsDenoised) {
    Scene scene = square_under_a_lamp();
    scene.environment.color = kSky;
    RenderSettings settings = wide();
    const Image noisy = beauty(scene, settings);
    settings.denoise = true;
    EXPECT_EQ(alpha_of(beauty(scene, settings)).pixels, alpha_of(noisy).pixels);
}

/// Returns the mean squared difference of the channels that are noisy: alpha, too, unless it is 1.
double squared_error(const Image& image, const Image& reference, bool alpha) {
    double sum = 0;
    const std::size_t channels = alpha ? 4 : 3;
    for (std::size_t i = 0; i < image.pixels.size(); i += 4)
        for (std::size_t c = 0; c < channels; ++c)
            sum += std::pow(double{image.pixels[i + c]} - double{reference.pixels[i + c]}, 2);
    return sum * 4 / double(channels * image.pixels.size());
}

// An error target counts the noise of shadows, in the colours that they darken and in alpha, and adaptive samples
// follow it.
TEST_F(ShadowCatcher, ShadowsHaveAnErrorThatIsKnown) {
    Scene scene = square_under_a_lamp();
    scene.lights.clear();
    scene.environment.color = kSky;
    add_quad(scene, add_material(scene, light_material(vec3(4))), {-0.3f, 2, -0.3f}, {0.6f, 0, 0}, {0, 0, 0.6f});
    PreparedScene prepared(context, scene);
    const ColorConfig colors = ColorConfig::load();
    for (const bool transparent : {true, false}) {
        RenderSettings settings = wide(16);
        settings.width = settings.height = 48;
        settings.transparent = transparent;
        FrameSettings many = settings;
        many.samples = 2048;
        const Image reference = Renderer(prepared, colors, settings).render(many).beauty;
        for (const bool adaptive : {false, true}) {
            SCOPED_TRACE(testing::Message()
                         << (transparent ? "alpha" : "colour") << (adaptive ? ", adaptive" : ", even"));
            settings.adaptive = adaptive;
            settings.error = ErrorTarget{ErrorMetric::mse, 1e-12};
            settings.samples = adaptive ? 64 : 16;
            Renderer renderer(prepared, colors, settings);
            double error = 0, estimate = 0;
            constexpr int kPictures = 12;
            RunningMoments means;
            FrameSettings frame = settings;
            for (frame.seed = 1; frame.seed <= kPictures; ++frame.seed) {
                const RenderResult result = renderer.render(frame);
                error += squared_error(result.beauty, reference, transparent) / kPictures;
                estimate += result.stats.error->estimate.value / kPictures;
                means.add(mean_of_pixels(alpha_of(result.beauty), 0).value);
            }
            EXPECT_NEAR(estimate / error, 1, 0.25) << "estimate " << estimate << ", error " << error;
            const double deviation = std::sqrt(means.variance() / kPictures);
            // The quotient of noisy sums has a bias, which falls with the number of samples.
            const double expected = mean_of_pixels(alpha_of(reference), 0).value;
            EXPECT_NEAR(means.mean(), expected, 4 * deviation + 0.02 * expected);
        }
    }
}

TEST_F(ShadowCatcher, IsLeftOut) {
    Scene scene = square_under_a_lamp();
    RenderSettings settings = wide(1);
    const auto left = [&] {
        return std::ranges::count(render(context, scene, settings).stats.left_out, "shadow catchers", &LeftOut::what);
    };
    EXPECT_EQ(left(), 0);
    scene.instances[0].catcher = false;
    EXPECT_EQ(left(), 1);
}

}  // namespace
}  // namespace halflight::test
