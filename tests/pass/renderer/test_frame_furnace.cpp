// Tests scenes of known radiance through the whole frame. The furnaces of all materials are in tests/stiff.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "engine/io/gltf/gltf.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

class FurnaceTest : public GpuTest {
  protected:
    /// Expects the picture's mean within four standard errors, and a half width of at most `precision` at 95 %.
    void expect_mean(const Image& image, double expected, double precision, const std::string& what) {
        for (int c = 0; c < 3; ++c) {
            const MeanValue m = mean_of_pixels(image, c);
            EXPECT_NEAR(m.value, expected, 4 * m.error + 2e-4 * expected) << what;
            EXPECT_LE(1.96 * m.error, precision * expected) << what << ": the test says nothing";
        }
    }
    static void expect_finite(const RenderResult& r, const std::string& what) {
        for (const BadValues& n : r.stats.bad_values) EXPECT_EQ(n.total(), 0u) << what << ", " << n.component;
        const NonFinite n = count_non_finite(r.beauty);
        EXPECT_EQ(n.nans + n.infinities, 0u) << what;
    }
};

TEST_F(FurnaceTest, ClosedBoxSumsTheSeriesOfItsAlbedo) {
    const double albedo = 0.8;
    Material glowing = diffuse_material(vec3(0.8f));
    glowing.emission = vec3(1);
    const Scene scene = closed_box(glowing);
    double expected = 0, power = 1;
    for (int bounces = 0; bounces <= 5; ++bounces, power *= albedo) {
        expected += power;
        if (bounces == 3 || bounces == 4) continue;
        const std::string what = "bounces " + std::to_string(bounces);
        const RenderResult r = render(context, scene, small_settings(camera_in_box(), 32, 32, 96, bounces));
        expect_finite(r, what);
        expect_mean(r.beauty, expected, 0.01, what);
        expect_mean(layer(r, "emission.R"), 1, 1e-6, what);
        if (bounces > 0) expect_mean(layer(r, "direct_diffuse.R"), albedo, 0.01, what);
        if (bounces > 1) expect_mean(layer(r, "indirect_diffuse.R"), expected - 1 - albedo, 0.01, what);
    }
}

TEST_F(FurnaceTest, SmoothBallsOfFewTrianglesAreWhite) {
    std::vector<std::pair<std::string, Material>> cases{{"diffuse", diffuse_material(vec3(1))}};
    for (const float roughness : {0.0f, 0.1f, 0.4f}) {
        cases.emplace_back("metal", metal_material(vec3(1), roughness));
        Material coated = metal_material(vec3(1), 0.5f);
        coated.metallic = 0, coated.clearcoat = 1, coated.clearcoat_roughness = roughness;
        cases.emplace_back("coat", coated);
    }
    for (const auto& [name, material] : cases) {
        Scene scene;
        scene.environment.color = vec3(1);
        add_smooth_ball(scene, add_material(scene, material), vec3(0), 1);
        scene.cameras = {look_at_camera({1, 1.5, 4}, {0, 0, 0}, {0, 1, 0}, 0.52)};
        RenderSettings settings = all_settings(scene, 48, 48, 256);
        settings.bounces = 32;
        const RenderResult r = render(context, scene, settings);
        const std::string what =
            fmt::format("{}, roughness {}, {}", name, material.roughness, material.clearcoat_roughness);
        expect_finite(r, what);
        expect_mean(r.beauty, 1, 0.003, what);
        if (material.metallic == 1) expect_mean(layer(r, "direct_diffuse.R"), 0, 0, what);
        const Image& albedo = layer(r, "albedo.R");
        float least = 1, most_albedo = 0;
        for (int y = 0; y < 48; ++y) {
            for (int x = 0; x < 48; ++x) {
                least = std::min(least, *r.beauty.at(x, y));
                for (int k = 0; k < 3; ++k) most_albedo = std::max(most_albedo, albedo.at(x, y)[k]);
            }
        }
        EXPECT_GT(least, 0.8f) << what;  // the rest is noise; dark rims reached 0.004
        EXPECT_LE(most_albedo, 1) << what;
    }
}

TEST_F(FurnaceTest, RandomNormalsAndSliversGainNothing) {
    for (const bool metal : {false, true}) {
        Scene scene;
        scene.environment.color = vec3(1);
        Material coated = metal_material(vec3(1), 0.3f);
        coated.metallic = metal, coated.clearcoat = 0.5f, coated.clearcoat_roughness = 0.1f;
        add_smooth_ball(scene, add_material(scene, coated), vec3(0), 1);
        Mesh& mesh = scene.meshes.back();
        for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
            const auto angle = static_cast<float>(i);
            const vec3 any = glm::normalize(vec3(std::sin(3 * angle), std::cos(7 * angle), std::sin(11 * angle)));
            if (i % 3 == 0) mesh.normals[i] = any;
            if (i % 5 == 0) mesh.normals[i] = -mesh.normals[i];
        }
        for (std::size_t i = 0; i + 2 < mesh.positions.size(); i += 27)
            mesh.positions[i + 2] = glm::mix(mesh.positions[i], mesh.positions[i + 2], 1e-5f);
        scene.cameras = {look_at_camera({1, 1.5, 4}, {0, 0, 0}, {0, 1, 0}, 0.52)};
        RenderSettings settings = all_settings(scene, 48, 48, 128);
        settings.bounces = 32;
        const RenderResult r = render(context, scene, settings);
        expect_finite(r, "random normals");
        const MeanValue mean = mean_of_pixels(r.beauty, 0);
        EXPECT_LT(mean.value, 1 + 4 * mean.error);
        EXPECT_GT(mean.value, 0.5);
    }
}

TEST_F(FurnaceTest, ScenesWithoutLosses) {
    for (const char* name : {"furnace", "furnace-half"}) {
        const Scene scene = load_gltf(std::string(HALFLIGHT_SOURCE_DIR "/scenes/") + name + ".glb");
        const RenderResult r = render(context, scene, small_settings(scene.cameras[0], 48, 32, 64, 48));
        expect_finite(r, name);
        expect_mean(r.beauty, 1, 0.01, name);
    }
}

TEST_F(FurnaceTest, ClosedWallsKeepTheSkyOut) {
    for (const dvec3& at : {dvec3(0), dvec3(1e6, -3e5, 2e6)}) {
        for (const bool instanced : {false, true}) {
            Scene scene;
            scene.environment.color = vec3(1);
            add_box(scene, add_material(scene, diffuse_material(vec3(0.9f))), vec3(-1), {1, 1, 3});
            const double c = std::cos(0.5), s = std::sin(0.5);
            scene.instances[0].object_to_world =
                dmat4(dvec4(c, s, 0, 0), dvec4(-s * c, c * c, s, 0), dvec4(s * s, -c * s, c, 0), dvec4(at, 1));
            if (instanced) {
                scene.instances.push_back(scene.instances[0]);
                scene.instances[1].object_to_world[3] += dvec4(9, 9, 9, 0);
            }
            const Camera inside = look_at_camera(at, at + dvec3(1, 0.7, 0.2), {0, 1, 0}, 2.5);
            // 2 10^6 segments of paths find leaks of one in 700,000 with a probability of 95 %.
            const RenderResult r = render(context, scene, small_settings(inside, 64, 64, 64, 8));
            int leaks = 0;
            for (int y = 0; y < 64; ++y)
                for (int x = 0; x < 64; ++x) leaks += *r.beauty.at(x, y) > 0;
            EXPECT_EQ(leaks, 0) << "x = " << at.x << ", instanced " << instanced;
        }
    }
}

TEST_F(FurnaceTest, WallsThatMeetAtSharpAnglesKeepTheSkyOut) {
    Scene scene = pyramids();
    scene.instances.resize(1);
    scene.instances[0].object_to_world[1] *= 0.15;  // sides with slopes of 12 to 16 degrees
    scene.environment.color = vec3(1);
    const Camera inside = look_at_camera({0.1, 0.06, 0.05}, {1, 0.015, 0.3}, {0, 1, 0}, 2.8);
    const RenderResult r = render(context, scene, small_settings(inside, 64, 64, 128, 4));
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x) EXPECT_EQ(*r.beauty.at(x, y), 0) << x << ", " << y;
}

}  // namespace
}  // namespace halflight::test
