// Tests path reuse across pixels: equal means, less noise, and no effect on paths without reuse.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "engine/core/statistics.h"
#include "tests/pass/picture/pixels.h"
#include "tests/pass/rays/batches.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

constexpr int kSeeds = 16;
constexpr int kBlock = 16;  // side in pixels; blocks share no paths

/// Indirect light of independent pictures, by component.
struct Indirect {
    Batches diffuse, glossy;  // means over blocks
    Batches diffuse_pixels, glossy_pixels;
};

class ReuseTest : public GpuTest {
  protected:
    static RenderSettings settings_with(Reuse reuse, const Camera& camera, int samples, int bounces, int size = 64) {
        RenderSettings settings = small_settings(camera, size, size, samples, bounces);
        settings.estimator.reuse = reuse;
        return settings;
    }

    Indirect indirect(const Scene& scene, Reuse reuse, int samples, int bounces) {
        PreparedScene prepared(context, scene, {.estimator = {.reuse = reuse}});
        const RenderSettings settings = settings_with(reuse, scene.cameras.front(), samples, bounces);
        Renderer renderer(prepared, ColorConfig::load(), settings);
        Indirect light;
        for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
            RenderSettings own = settings;
            own.seed = seed + 1000 * static_cast<std::uint32_t>(reuse);
            const RenderResult r = renderer.render(own);
            EXPECT_EQ(r.stats.estimator.reuse, reuse);
            for (const BadValues& n : r.stats.bad_values) EXPECT_EQ(n.total(), 0u) << n.component;
            const Image &diffuse = layer(r, "indirect_diffuse.R"), &glossy = layer(r, "indirect_glossy.R");
            light.diffuse.add(block_means(diffuse, kBlock));
            light.glossy.add(block_means(glossy, kBlock));
            light.diffuse_pixels.add(diffuse);
            light.glossy_pixels.add(glossy);
        }
        return light;
    }

    /// Compares block means with and without reuse, per component of the receiver.
    void expect_the_same_mean(const std::string& name, const Scene& scene, int samples = 6, int bounces = 4,
                              std::initializer_list<Reuse> sizes = {Reuse::sixteen}) {
        Indirect own = indirect(scene, Reuse::off, samples, bounces);
        const Agreement limits{.p_value = 1e-5, .relative_difference = 0.01};
        for (const Reuse reuse : sizes) {
            Indirect reused = indirect(scene, reuse, samples, bounces);
            const std::string what = fmt::format("reuse{}-{}-", halflight::name(reuse), name);
            EXPECT_TRUE(agree(what + "diffuse", reused.diffuse.estimate(), own.diffuse.estimate(), limits));
            EXPECT_TRUE(agree(what + "glossy", reused.glossy.estimate(), own.glossy.estimate(), limits));
        }
    }
};

/// Returns a room divided by slats and lit on one side, so that visibility differs within groups. Patches of the floor
/// and of the slats differ in albedo, and the sides of a small tent in normals.
Scene parted_room() {
    Scene scene = closed_box(diffuse_material({0.7f, 0.6f, 0.5f}));
    for (int i = 0; i < 8; ++i) {
        const float x = -0.95f + 0.25f * static_cast<float>(i);
        const int slat = add_material(scene, diffuse_material(vec3(0.1f * static_cast<float>(1 + i))));
        add_box(scene, slat, {x, -1, -0.3f}, {x + 0.1f, 0.6f, -0.25f});
        const int patch = add_material(scene, diffuse_material({0.9f, 0.1f * static_cast<float>(i), 0}));
        add_quad(scene, patch, {x, -0.99f, 0}, {0, 0, 0.9f}, {0.12f, 0, 0});
    }
    const int tent = add_material(scene, diffuse_material(vec3(0.8f)));
    add_quad(scene, tent, {-0.2f, -0.99f, 0.1f}, {0, 0, 0.5f}, {0.2f, 0.3f, 0});
    add_quad(scene, tent, {0, -0.69f, 0.1f}, {0, 0, 0.5f}, {0.2f, -0.3f, 0});
    add_quad(scene, add_material(scene, light_material({8, 9, 10})), {-0.3f, 0.98f, -0.9f}, {0.6f, 0, 0}, {0, 0, 0.4f});
    scene.cameras = {look_at_camera({0.1, 0.2, 0.95}, {0, -0.35, -0.3}, {0, 1, 0}, 1.5)};
    return scene;
}

/// Returns the Cornell box with plastic, varnished and metal walls and a mirror.
Scene glossy_room() {
    Scene scene = cornell_box(metal_material({0.9f, 0.8f, 0.7f}, 0));
    Material& plastic = scene.materials[0];
    plastic.specular = 1, plastic.ior = 1.8f, plastic.roughness = 0.5f;
    Material& varnished = scene.materials[1];
    varnished.clearcoat = 0.9f, varnished.clearcoat_roughness = 0.4f;
    Material& sheen = scene.materials[2];
    sheen.metallic = 0.5f, sheen.specular = 0.7f, sheen.roughness = 0.4f, sheen.anisotropy_strength = 0.8f;
    Material pane = metal_material({0.8f, 0.9f, 0.9f}, 0.5f);
    pane.metallic = 0, pane.transmission = 0.8f;
    add_quad(scene, add_material(scene, pane), {0.1f, -0.9f, 0.75f}, {0.7f, 0, 0}, {0, 1.2f, 0});
    for (Mesh& mesh : scene.meshes) {
        for (const vec3& n : mesh.normals)
            mesh.tangents.emplace_back(glm::normalize(glm::cross(n, vec3(0.36f, 0.48f, 0.8f))), 1);
    }
    return scene;
}

TEST_F(ReuseTest, KeepsTheMeanBehindSlats) {
    expect_the_same_mean("slats", parted_room(), 6, 4, {Reuse::four, Reuse::eight, Reuse::sixteen});
}

TEST_F(ReuseTest, KeepsTheMeanOfGlossyReceiversAndPoints) {
    expect_the_same_mean("glossy", glossy_room(), 8);
}

TEST_F(ReuseTest, KeepsTheMeanAlongBentNormals) {
    expect_the_same_mean("textures", textured_scene(), 8);
}

TEST_F(ReuseTest, KeepsTheMeanThroughVeils) {
    expect_the_same_mean("curtains", curtain_scene());
}

TEST_F(ReuseTest, ClosedRoomsSumTheSeriesOfTheirAlbedo) {
    const double albedo = 0.8;
    Material glowing = diffuse_material(vec3(0.8f));
    glowing.emission = vec3(1);
    Scene scene = closed_box(glowing);
    scene.cameras = {camera_in_box()};
    for (const int bounces : {2, 5}) {
        Indirect light = indirect(scene, Reuse::sixteen, 4, bounces);
        RunningMoments blocks;
        for (const float v : light.diffuse.mean().pixels) blocks.add(v);
        const double exact = (std::pow(albedo, 2) - std::pow(albedo, bounces + 1)) / (1 - albedo);
        // All channels have equal values.
        EXPECT_NEAR(blocks.mean(), exact, 4.5 * std::sqrt(3.0) * blocks.standard_error() + 2e-4 * exact) << bounces;
        EXPECT_LT(blocks.standard_error(), 0.003 * exact) << "the test has no power";
    }
}

TEST_F(ReuseTest, LowersTheNoise) {
    const Scene scene = cornell_box();
    const double own = indirect(scene, Reuse::off, 4, 4).diffuse_pixels.variance();
    const double four = indirect(scene, Reuse::four, 4, 4).diffuse_pixels.variance();
    const double eight = indirect(scene, Reuse::eight, 4, 4).diffuse_pixels.variance();
    const double sixteen = indirect(scene, Reuse::sixteen, 4, 4).diffuse_pixels.variance();
    EXPECT_LT(four, 0.6 * own);
    EXPECT_LT(eight, 0.8 * four);
    EXPECT_LT(sixteen, 0.25 * own);
}

/// The members of a group change from sample to sample, so no two pixels of a block share much noise.
TEST_F(ReuseTest, DecorrelatesTheNoiseOfAGroup) {
    const Scene scene = cornell_box();
    RenderSettings settings = settings_with(Reuse::sixteen, scene.cameras.front(), 16, 4);
    const RenderResult one = render(context, scene, settings);
    settings.seed = 2;
    const RenderResult other = render(context, scene, settings);
    const Image &a = layer(one, "indirect_diffuse.R"), &b = layer(other, "indirect_diffuse.R");
    const auto noise = [&](int x, int y) { return double(a.at(x, y)[0]) - b.at(x, y)[0]; };
    double variance = 0;
    for (const auto& [x, y] : pixels_of({settings.width, settings.height})) variance += noise(x, y) * noise(x, y);
    variance /= settings.width * settings.height;
    for (const ivec2 step : {ivec2(1, 0), ivec2(4, 0), ivec2(0, 4), ivec2(8, 0), ivec2(8, 8)}) {
        RunningMoments covariance;
        for (const auto& [x, y] : pixels_of({settings.width, settings.height}))
            if (x % kBlock + step.x < kBlock && y % kBlock + step.y < kBlock)
                covariance.add(noise(x, y) * noise(x + step.x, y + step.y));
        EXPECT_LT(covariance.mean(), 0.3 * variance) << step.x << ", " << step.y;
    }
}

/// Mirror reflections have no density, so they take no part in reuse.
TEST_F(ReuseTest, MirrorsKeepTheirPaths) {
    Scene scene = cornell_box();
    add_quad(scene, add_material(scene, metal_material(vec3(0.9f), 0)), {-3, -3, 1.5f}, {6, 0, 0}, {0, 6, 0});
    scene.cameras = {look_at_camera({0, 0, 1.2}, {0.1, 0.05, 2}, {0, 1, 0}, 1.0)};
    const auto picture = [&](Reuse reuse) {
        return render(context, scene, settings_with(reuse, scene.cameras.front(), 4, 4));
    };
    const RenderResult reused = picture(Reuse::sixteen);
    EXPECT_GT(mean_of_pixels(layer(reused, "indirect_glossy.R"), 0).value, 0.01);
    expect_same(reused, picture(Reuse::off));
}

TEST_F(ReuseTest, ClampsTheSumOfAReceiver) {
    const Scene scene = shiny_cornell();
    RenderSettings settings = settings_with(Reuse::sixteen, scene.cameras.front(), 1, 4);
    const RenderResult plain = render(context, scene, settings);
    settings.clamp = 0.05f;
    const RenderResult clamped = render(context, scene, settings);
    const auto luminance = [](const RenderResult& r, int x, int y) {
        double sum = 0;
        for (const char* name : {"indirect_diffuse.R", "indirect_glossy.R"}) {
            const float* p = layer(r, name).at(x, y);
            sum += 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2];
        }
        return sum;
    };
    int dimmed = 0, kept = 0;
    for (const auto& [x, y] : pixels_of({settings.width, settings.height})) {
        const double before = luminance(plain, x, y);
        ASSERT_NEAR(luminance(clamped, x, y), std::min(before, 0.05), 1e-5);
        ++(before > 0.05 ? dimmed : kept);
    }
    EXPECT_GT(dimmed, 100);
    EXPECT_GT(kept, 100);
}

TEST_F(ReuseTest, IsReported) {
    const Scene scene = cornell_box();
    RenderSettings settings = settings_with(Reuse::sixteen, scene.cameras.front(), 1, 1, 16);
    EXPECT_EQ(render(context, scene, settings).stats.estimator.reuse, Reuse::off) << "there is no indirect light";
    settings.bounces = 2;
    const auto connects = [&] {
        const RenderStats stats = render(context, scene, settings).stats;
        const bool traced = std::ranges::any_of(stats.batches, [](const auto& b) { return b.batch == "connection"; });
        EXPECT_EQ(traced, stats.estimator.reuse == Reuse::sixteen);
        return traced;
    };
    EXPECT_TRUE(connects());
    settings.estimator.reuse = Reuse::off;
    EXPECT_FALSE(connects());
}

}  // namespace
}  // namespace halflight::test
