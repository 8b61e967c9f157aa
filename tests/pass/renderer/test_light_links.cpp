// Tests light links: lights light their receivers alone, other objects cast no shadows of them, and links that leave
// nothing out change no bit.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

constexpr std::uint64_t kAll = ~std::uint64_t{0};
constexpr std::uint64_t except(int link_class) {
    return kAll & ~(std::uint64_t{1} << link_class);
}

/// Returns a floor of 8 x 8 (class 0) and a square of 1 x 1 (class 1) that hangs halfway below a lamp. Its shadow is
/// [-1, 1] x [-1, 1].
Scene square_under_a_lamp() {
    Scene scene;
    add_quad(scene, add_material(scene, diffuse_material(vec3(0.5f))), {-4, 0, -4}, {0, 0, 8}, {8, 0, 0});
    add_quad(scene, add_material(scene, diffuse_material({0.9f, 0.1f, 0.1f})), {-0.5f, 1, -0.5f}, {0, 0, 1}, {1, 0, 0});
    scene.instances[1].link_class = 1;
    PunctualLight& lamp = scene.lights.emplace_back();
    lamp.position = {0, 2, 0};
    lamp.intensity = vec3(5);
    return scene;
}

/// Returns settings for a view of the floor from which the square does not hide the spot.
RenderSettings spot_settings(double x, double z, double size, int bounces) {
    RenderSettings settings = small_settings(spot_camera({x, 0, z}, {0.3, 0.5, 0.6}, size), 16, 16, 4, bounces);
    settings.aovs.clear();
    return settings;
}

/// Returns a view of all of a room with lights of all kinds, three of them linked.
Scene linked_room() {
    Scene scene = cornell_box(metal_material(vec3(0.9f), 0.2f));
    for (std::size_t i = 0; i < scene.instances.size(); ++i)
        scene.instances[i].link_class = static_cast<std::uint8_t>(i % 3);
    scene.environment.color = {0.3f, 0.4f, 0.6f};
    scene.environment.links = {except(1), kAll};
    PunctualLight& lamp = scene.lights.emplace_back();
    lamp.position = {0.3, 0.2, 0.4};
    lamp.radius = 0.1f;
    lamp.intensity = {0.5f, 0.4f, 0.2f};
    lamp.links = {except(2), except(0)};
    PunctualLight& sun = scene.lights.emplace_back();
    sun.type = LightType::directional;
    sun.direction = glm::normalize(vec3(0.3f, -0.5f, -1));
    sun.links = {kAll, except(1)};
    return scene;
}

class LightLinks : public GpuTest {
  protected:
    Image beauty(const Scene& scene, const RenderSettings& settings) {
        const RenderResult result = render(context, scene, settings);
        for (const BadValues& n : result.stats.bad_values) EXPECT_EQ(n.total(), 0u) << n.component;
        return result.beauty;
    }
    float most(const Scene& scene, const RenderSettings& settings) {
        Image image = rgb(beauty(scene, settings));
        return *std::ranges::max_element(image.pixels);
    }
};

TEST_F(LightLinks, ReceiversAloneAreLit) {
    Scene scene = square_under_a_lamp();
    const RenderSettings settings = spot_settings(1.5, 1.5, 0.01, 1);
    const double square = 2 * 1.5 * 1.5 + 4;
    EXPECT_NEAR(most(scene, settings), 0.5 / kPi * 5 * 2 / std::pow(square, 1.5), 1e-3);
    scene.lights[0].links.receivers = except(0);
    EXPECT_EQ(most(scene, settings), 0) << "the floor";
    RenderSettings two = settings;
    two.bounces = 2;
    EXPECT_EQ(most(scene, two), 0) << "the square's light side faces away";
    scene.instances[1].object_to_world =
        dmat4(dvec4(1, 0, 0, 0), dvec4(0, 1, 0, 0), dvec4(0, 0, 1, 0), dvec4(0, 2, 0, 1));
    EXPECT_GT(most(scene, two), 0) << "light that the square reflects";
    scene.lights[0].links.receivers = except(1);
    EXPECT_GT(most(scene, settings), 0);
}

TEST_F(LightLinks, LampsThatRaysMeetObeyThem) {
    // Mirrors and rough metal find the lamp, the panel and the sky by their own rays.
    for (const float roughness : {0.0f, 0.3f}) {
        Scene scene;
        add_quad(scene, add_material(scene, metal_material(vec3(0.9f), roughness)), {-4, 0, -4}, {0, 0, 8}, {8, 0, 0});
        scene.instances[0].link_class = 40;
        add_quad(scene, add_material(scene, light_material(vec3(4))), {-3, 3, -3}, {6, 0, 0}, {0, 0, 3});
        scene.lights.resize(2);
        PunctualLight &lamp = scene.lights[0], &sun = scene.lights[1];
        lamp.position = {0, 2, 1};
        lamp.radius = 0.5f;
        sun.type = LightType::directional, sun.angle = 1;
        sun.direction = glm::normalize(vec3(0.3f, -0.5f, -0.6f));
        scene.environment.color = vec3(0.5f);
        const RenderSettings settings = spot_settings(0, 0, 0.5, 3);
        EXPECT_GT(most(scene, settings), 0);
        lamp.links.receivers = sun.links.receivers = except(40);
        scene.environment.links.receivers = scene.materials[1].links.receivers = except(40);
        EXPECT_EQ(most(scene, settings), 0) << roughness;
        scene.instances[0].link_class = 41;
        EXPECT_GT(most(scene, settings), 0);
    }
}

TEST_F(LightLinks, LightPassesObjectsThatCastNoShadows) {
    Scene scene = square_under_a_lamp(), without = scene;
    without.instances.pop_back();
    const RenderSettings settings = spot_settings(0.3, 0.3, 0.5, 1);
    const Image unshaded = rgb(beauty(without, settings));
    const auto expect_unshaded = [&] {
        const Image image = rgb(beauty(scene, settings));
        for (std::size_t i = 0; i < image.pixels.size(); ++i)
            EXPECT_NEAR(image.pixels[i], unshaded.pixels[i], 1e-5f * unshaded.pixels[i]) << i;
    };
    EXPECT_EQ(most(scene, settings), 0) << "in the shadow";
    scene.lights[0].links.blockers = except(1);
    expect_unshaded();
    // Instances share a mesh, and one of them keeps its shadow.
    scene.instances.push_back(scene.instances[1]);
    scene.instances[2].link_class = 0;
    EXPECT_EQ(most(scene, settings), 0);
    scene.instances[2].object_to_world[3].x = 3;
    expect_unshaded();
    // A pane of tinted glass is no shadow, and no colour either.
    Material pane = glass_material(0);
    pane.thickness = 0, pane.base_color = {0.2f, 0.5f, 0.9f, 1};
    scene.instances.pop_back();
    scene.materials[1] = pane;
    expect_unshaded();
    scene.lights[0].links = {};
    EXPECT_LT(most(scene, settings), 0.95f * most(without, settings));
}

TEST_F(LightLinks, AllTracersAgree) {
    const Scene scene = linked_room();
    RenderSettings settings = small_settings(scene.cameras[0], 32, 32, 4, 4);
    settings.aovs.clear();
    settings.culling = rays::Culling::off;
    const Image plain = beauty(scene, settings);
    for (const rays::Culling culling : {rays::Culling::compute, rays::Culling::raster, rays::Culling::native}) {
        settings.culling = culling;
        EXPECT_EQ(beauty(scene, settings).pixels, plain.pixels) << int(culling);
    }
}

TEST_F(LightLinks, ThatLeaveNothingOutChangeNoBit) {
    Scene scene = linked_room();
    for (PunctualLight& light : scene.lights) light.links = {}, light.radius = 0;
    scene.environment.links = {};
    RenderSettings settings = small_settings(scene.cameras[0], 32, 32, 4, 4);
    const RenderResult plain = render(context, scene, settings);
    EXPECT_TRUE(plain.stats.biases.empty());
    for (PunctualLight& light : scene.lights) light.links = {except(63), except(62)};  // no object has these classes
    scene.environment.links.receivers = except(63);
    const RenderResult linked = render(context, scene, settings);
    expect_same(plain, linked);
    ASSERT_EQ(linked.stats.biases.size(), 1u) << "a departure from physics is named";
    EXPECT_NE(linked.stats.biases[0].find("light links"), std::string::npos);
}

TEST_F(LightLinks, ShadowCatchersObeyThem) {
    Scene scene = square_under_a_lamp();
    scene.instances[0].catcher = true;
    RenderSettings settings = spot_settings(0.3, 0.3, 0.5, 1);
    settings.transparent = true;
    const auto alpha = [&] {
        const Image image = beauty(scene, settings);
        return std::pair(image.pixels[3], image.pixels.back());
    };
    EXPECT_EQ(alpha(), std::pair(1.0f, 1.0f));
    scene.lights[0].links.blockers = except(1);
    EXPECT_EQ(alpha(), std::pair(0.0f, 0.0f)) << "the square casts no shadow of the lamp";
    scene.lights[0].links = {except(0), kAll};
    EXPECT_EQ(alpha(), std::pair(0.0f, 0.0f)) << "the lamp does not light the catcher";
}

TEST_F(LightLinks, GroupsAddUpToThePicture) {
    Scene scene = linked_room();
    scene.light_groups = {"lamp", "rest"};
    scene.lights[0].light_group = 0;
    RenderSettings settings = small_settings(scene.cameras[0], 32, 32, 4, 4);
    settings.aovs = {"light_lamp", "light_rest"};
    const RenderResult result = render(context, scene, settings);
    double sum = 0, parts = 0;
    for (std::size_t i = 0; i < result.beauty.pixels.size(); i += 4) sum += double(result.beauty.pixels[i]);
    for (const char* part : {"light_lamp.R", "light_rest.R"})
        for (std::size_t i = 0; i < layer(result, part).pixels.size(); i += 3)
            parts += double(layer(result, part).pixels[i]);
    EXPECT_NEAR(parts, sum, 1e-5 * sum);
}

}  // namespace
}  // namespace halflight::test
