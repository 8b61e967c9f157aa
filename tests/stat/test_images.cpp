// Tests pictures of the engine against those of the oracle, for the scenes of scenes/ and for small scenes with other
// features.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <vector>

#include "engine/core/statistics.h"
#include "engine/io/gltf/gltf.h"
#include "engine/io/ies.h"
#include "engine/reference/reference.h"
#include "tests/pass/rays/batches.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"
#include "tests/support/ies_files.h"
#include "tests/support/image_tests.h"

namespace halflight::test {
namespace {

struct Trial {
    std::string name;
    std::optional<Camera> camera{};  // none: the scene's first one
    int samples = 128;               // per pixel, of the engine and of the oracle
    int bounces = 8;
    Backfaces backfaces = Backfaces::automatic;
    bool show_lamps = false;
    // Single pixels are tested against the variance of their samples, blocks of components against the scatter of
    // batches. A bias of 1 % and 5.3 standard errors of the whole component is found with a probability of 90 %; a
    // correct component is refused with one of 3e-5. At 256 samples, cornell-metal has standard errors of 0.35 %
    // (direct diffuse), 0.6 % (direct glossy), 1.9 % (indirect diffuse) and 3.8 % (indirect glossy).
    Agreement beauty = {.above_3 = 0.01, .relative_difference = 0.005};
    Agreement component = {.p_value = 1e-5, .relative_difference = 0.01};
};

/// Returns the factor on sample counts, $HALFLIGHT_IMAGE_EFFORT. Errors shrink by its square root, so that smaller
/// differences become visible.
int effort() {
    const char* value = std::getenv("HALFLIGHT_IMAGE_EFFORT");
    return value ? std::max(std::atoi(value), 1) : 1;
}

constexpr int kWidth = 48, kHeight = 36;  // pixels
constexpr int kBatches = 16;
constexpr int kBlock = 8;
constexpr int kGroupBlock = 16;  // side in pixels; blocks share no paths
constexpr const char* kComponents[] = {"emission", "direct_diffuse", "direct_glossy", "indirect_diffuse",
                                       "indirect_glossy"};

Scene load(const std::string& name) {
    return load_gltf(HALFLIGHT_SOURCE_DIR "/scenes/" + name + ".glb");
}

class ImageTest : public GpuTest {
  protected:
    /// Compares beauty and all components from kBatches batches each, and indirect light with path reuse. Without
    /// reuse, noise is independent from pixel to pixel, like the oracle's. Rare light then affects the tests of single
    /// pixels equally on both sides.
    void expect_agreement(const Scene& scene, Trial trial) {
        trial.samples *= effort();
        const Camera camera = trial.camera.value_or(scene.cameras[0]);
        std::array<Batches, 6> ours, oracle;
        std::array<Batches, 2> reused, oracle_indirect;  // one per component: diffuse, glossy
        Batches our_variance, oracle_variance;           // variance of one sample
        std::uint64_t bad_values = 0;
        RenderSettings settings = small_settings(camera, kWidth, kHeight, trial.samples / kBatches, trial.bounces);
        const ColorConfig colors = ColorConfig::load();
        settings.backfaces = trial.backfaces;
        settings.show_lamps = trial.show_lamps;
        settings.estimator.reuse = Reuse::off;
        Renderer plain(context, scene, colors, settings);
        settings.estimator.reuse = Reuse::sixteen;
        Renderer reusing(context, scene, colors, settings);
        for (int b = 0; b < kBatches; ++b) {
            settings.seed = static_cast<std::uint32_t>(b);
            const RenderResult r = plain.render(settings);
            const RenderResult with_reuse = reusing.render(settings);
            for (std::size_t c = 0; c < 2; ++c)
                reused[c].add(block_means(layer(with_reuse, std::string(kComponents[3 + c]) + ".R"), kGroupBlock));
            for (const BadValues& n : with_reuse.stats.bad_values) bad_values += n.total();
            ours[5].add(rgb(r.beauty));
            Image variance = layer(r, "variance.R");
            for (float& v : variance.pixels) v *= static_cast<float>(settings.samples);
            our_variance.add(variance);
            for (std::size_t c = 0; c < 5; ++c)
                ours[c].add(block_means(layer(r, std::string(kComponents[c]) + ".R"), kBlock));
            for (const BadValues& n : r.stats.bad_values) bad_values += n.total();
        }
        const ReferenceScene reference(scene);
        for (int b = 0; b < kBatches; ++b) {
            ReferenceSettings to_compare;
            to_compare.width = kWidth, to_compare.height = kHeight;
            to_compare.samples = trial.samples / kBatches;
            to_compare.first_sample = b * to_compare.samples;
            to_compare.bounces = trial.bounces;
            to_compare.camera = camera;
            to_compare.backfaces = trial.backfaces;
            to_compare.show_lamps = trial.show_lamps;
            const ReferenceResult r = render_reference(reference, to_compare);
            const ReferenceComponents& k = r.components;
            const Image* images[] = {&k.emission, &k.direct_diffuse, &k.direct_glossy, &k.indirect_diffuse,
                                     &k.indirect_glossy};
            for (std::size_t c = 0; c < 5; ++c) oracle[c].add(block_means(*images[c], kBlock));
            for (std::size_t c = 0; c < 2; ++c) oracle_indirect[c].add(block_means(*images[3 + c], kGroupBlock));
            oracle[5].add(r.beauty);
            oracle_variance.add(r.variance);
            EXPECT_EQ(r.non_finite_samples, 0u);
        }
        EXPECT_EQ(bad_values, 0u);
        for (std::size_t c = 0; c < 5; ++c) {
            std::printf("  %s-%s:\n", trial.name.c_str(), kComponents[c]);
            report(agree(trial.name + "-" + kComponents[c], ours[c].estimate(), oracle[c].estimate(), trial.component));
        }
        for (std::size_t c = 0; c < 2; ++c) {
            const std::string name = trial.name + "-reused-" + kComponents[3 + c];
            std::printf("  %s:\n", name.c_str());
            report(agree(name, reused[c].estimate(), oracle_indirect[c].estimate(), trial.component));
        }
        const double samples = trial.samples;
        report(agree(trial.name + "-beauty", {ours[5].mean(), our_variance.mean(), samples},
                     {oracle[5].mean(), oracle_variance.mean(), samples}, trial.beauty));
        // Both renderers weigh the same two sampling techniques. They differ in light selection and in the start of
        // Russian roulette.
        std::vector<double> ratios;
        for (std::size_t i = 0; i < our_variance.mean().pixels.size(); ++i) {
            const double mine = our_variance.mean().pixels[i], other = oracle_variance.mean().pixels[i];
            if (mine > 0 && other > 0) ratios.push_back(mine / other);
        }
        std::printf("  %s: variance %.3f of the oracle's (median of pixels)\n", trial.name.c_str(), median(ratios));
        EXPECT_LT(median(ratios), 1.5);
    }

    /// Prints the numbers of passed tests, too, because reports quote them.
    static void report(const ::testing::AssertionResult& result) {
        if (result) std::printf("  %s\n", result.message());
        EXPECT_TRUE(result);
    }
};

TEST_F(ImageTest, Cornell) {
    expect_agreement(load("cornell"), {.name = "cornell", .samples = 256});
}

TEST_F(ImageTest, CornellMetal) {
    expect_agreement(load("cornell-metal"), {.name = "cornell-metal", .samples = 256});
}

TEST_F(ImageTest, Atrium) {
    expect_agreement(load("atrium"), {.name = "atrium"});
}

TEST_F(ImageTest, StillLife) {
    expect_agreement(load("still-life"), {.name = "still-life"});
}

TEST_F(ImageTest, Room) {
    expect_agreement(load("room"), {.name = "room"});
}

/// Three lamps with profiles light a box with a glossy block from within, one of them with a size.
TEST_F(ImageTest, LightProfiles) {
    Scene scene = cornell_box(metal_material({0.9f, 0.8f, 0.6f}, 0.3f));
    for (Material& material : scene.materials) material.emission = vec3(0);
    for (const IesFile& file : {downlight(), street_lamp(), washer()})
        scene.light_profiles.push_back(read_ies("test.ies", file.text()));
    const auto add = [&](int profile, const dvec3& at, const dvec3& turn, float intensity) {
        PunctualLight& lamp = scene.lights.emplace_back();
        lamp.profile = profile;
        lamp.position = at;
        lamp.intensity = intensity * vec3(1, 0.8f, 0.6f);
        const dvec3 z = glm::normalize(turn), x = glm::normalize(glm::cross(dvec3(0.3, 1, 0.2), z));
        lamp.direction = vec3(-z);
        set_profile_axes(lamp, dmat3(x, glm::cross(z, x), z));
    };
    add(0, {0.3, 0.7, 0.2}, {0.1, 1, 0}, 1);
    add(1, {-0.5, 0.4, 0.3}, {0.5, 0.6, 0.4}, 0.6f);
    add(2, {0.1, 0.1, 0.6}, {-0.3, -0.4, 0.8}, 0.8f);
    scene.lights.back().radius = 0.1f;
    expect_agreement(scene, {.name = "light-profiles", .samples = 64, .bounces = 4});
}

/// A panel, a lamp with a size, a sun and a sky light some objects each, and light of three of them passes some.
TEST_F(ImageTest, LightLinks) {
    Scene scene = cornell_box(metal_material({0.9f, 0.8f, 0.6f}, 0.7f));
    Material pane = glass_material(0);
    pane.thickness = 0, pane.base_color = {0.4f, 0.7f, 0.9f, 1};
    add_quad(scene, add_material(scene, pane), {-0.9f, -0.4f, 0.5f}, {1, 0, 0.2f}, {0, 0.8f, 0});
    for (std::size_t i = 0; i < scene.instances.size(); ++i)
        scene.instances[i].link_class = static_cast<std::uint8_t>(i % 4);
    const auto except = [](int own) { return ~(std::uint64_t{1} << own); };
    for (Material& material : scene.materials) {
        material.emission *= 0.3f;
        if (material.emission != vec3(0)) material.links = {except(1), except(2)};
    }
    scene.environment.color = {0.3f, 0.4f, 0.6f};
    scene.environment.links = {except(2), except(3)};
    PunctualLight& lamp = scene.lights.emplace_back();
    lamp.position = {0.3, 0.2, 0.4};
    lamp.radius = 0.15f;
    lamp.intensity = {0.5f, 0.4f, 0.2f};
    lamp.links = {except(0), except(1) & except(2)};
    PunctualLight& other = scene.lights.emplace_back(lamp);
    other.position = {-0.5, 0.5, 0.3};
    other.links.blockers = ~std::uint64_t{0};
    PunctualLight& sun = scene.lights.emplace_back();
    sun.type = LightType::directional, sun.angle = 0.2f;
    sun.direction = glm::normalize(vec3(0.3f, -0.5f, -1));
    sun.links = {except(3), except(0)};
    expect_agreement(scene, {.name = "light-links", .samples = 64, .bounces = 4});
}

TEST_F(ImageTest, Textures) {
    expect_agreement(textured_scene(), {.name = "textures", .bounces = 4});
}

/// Gives all vertices a tangent, horizontal if the normal is not vertical.
void set_tangents(Scene& scene) {
    for (Mesh& mesh : scene.meshes) {
        mesh.tangents.clear();
        for (const vec3& n : mesh.normals) {
            const vec3 t = glm::cross(n, std::abs(n.y) < 0.9f ? vec3(0, 1, 0) : vec3(1, 0, 0));
            mesh.tangents.emplace_back(glm::normalize(t), 1);
        }
    }
}

/// Returns the Cornell box with changed materials. `change` receives every material that does not emit, and in turn the
/// numbers 0, 1 and 2.
Scene cornell_with(void (*change)(Material&, int)) {
    Scene scene = load("cornell");
    int number = 0;
    for (Material& m : scene.materials)
        if (m.emission == vec3(0)) change(m, number++ % 3);
    set_tangents(scene);
    return scene;
}

TEST_F(ImageTest, SheenAnisotropyAndIridescence) {
    // Each lobe has a third of the materials.
    const Scene scene = cornell_with([](Material& m, int number) {
        m.roughness = 0.4f;
        switch (number) {
            case 0:
                m.sheen_color = vec3(0.9f, 0.5f, 0.8f);
                m.sheen_roughness = 0.6f;
                m.clearcoat = 0.5f;
                break;
            case 1:
                m.metallic = 0.8f, m.specular = 1;
                m.anisotropy_strength = 0.7f, m.anisotropy_rotation = 1.4f;
                break;
            default:
                m.metallic = 0.3f, m.specular = 0.8f;
                m.iridescence = 0.9f;
                m.iridescence_ior = 1.6f;
                m.iridescence_thickness_maximum = 400;
        }
    });
    expect_agreement(scene, {.name = "lobes"});
}

/// Returns a diffuse floor under a bright sky and a square light that is large, because only sampled directions find
/// light through glass.
Scene studio(const vec3& light = {2, 1.8f, 1.5f}, float size = 1) {
    Scene scene;
    scene.environment.color = vec3(0.4f, 0.5f, 0.6f);
    add_quad(scene, add_material(scene, diffuse_material({0.7f, 0.6f, 0.5f})), {-3, 0, -3}, {0, 0, 6}, {6, 0, 0});
    add_quad(scene, add_material(scene, light_material(light)), {-1.5f, 2.5f, -1}, {3 * size, 0, 0}, {0, 0, 2 * size});
    scene.cameras = {look_at_camera({0.3, 1.2, 4}, {0, 0.5, 0}, {0, 1, 0}, 0.7)};
    return scene;
}

TEST_F(ImageTest, Solids) {
    Scene scene = studio();
    Material green = glass_material(0.3f);
    green.attenuation_color = {0.3f, 0.9f, 0.5f};
    green.attenuation_distance = 0.7f;
    Material clear = glass_material(0), pane = green;
    clear.ior = 1.4f;
    clear.base_color = {1, 0.9f, 0.7f, 1};
    pane.roughness = 0.5f, pane.thickness = 0.4f;
    Material varnished = green;
    varnished.transmission = 0.6f, varnished.clearcoat = 0.7f, varnished.metallic = 0.2f;
    varnished.roughness = 0.6f, varnished.sheen_color = vec3(0.4f), varnished.sheen_roughness = 0.5f;
    add_box(scene, add_material(scene, green), {-1.6f, 0.05f, -0.5f}, {-0.6f, 1, 0.5f});
    add_box(scene, add_material(scene, diffuse_material({0.8f, 0.3f, 0.2f})), {-1.2f, 0.3f, -0.1f},
            {-0.9f, 0.6f, 0.2f});
    const int ball = add_ball(scene, add_material(scene, clear), vec3(0), 0.5f);
    scene.instances[static_cast<std::size_t>(ball)].object_to_world =
        dmat4(dvec4(-1, 0, 0, 0), dvec4(0, 0.9, 0.3, 0), dvec4(0, -0.3, 1.1, 0), dvec4(0.1, 0.7, 0, 1));  // mirrors
    add_box(scene, add_material(scene, varnished), {0.9f, 0.05f, -0.4f}, {1.7f, 0.8f, 0.4f});
    add_quad(scene, add_material(scene, pane), {-0.7f, 0.1f, 0.8f}, {1, 0, 0.2f}, {0, 0.5f, 0});  // open
    scene.cameras[0].vertical_fov = 0.8;
    expect_agreement(scene, {.name = "solids"});
}

TEST_F(ImageTest, BackFaces) {
    // A room is seen through a wall, a pane and a mirror. A lamp with a back and a mirrored screen hang in it.
    const auto one_sided = [](Material m) {
        m.double_sided = false;
        return m;
    };
    Scene scene;
    scene.environment.color = vec3(0.3f, 0.4f, 0.5f);
    const int walls = add_material(scene, one_sided(diffuse_material({0.7f, 0.6f, 0.5f})));
    const int screen = add_material(scene, one_sided(diffuse_material({0.8f, 0.3f, 0.2f})));
    const int lamp = add_material(scene, one_sided(light_material({6, 5, 4})));
    add_quad(scene, walls, {-1, -1, -1}, {0, 0, 2}, {2, 0, 0});  // floor
    add_quad(scene, walls, {-1, 1, -1}, {2, 0, 0}, {0, 0, 2});   // ceiling
    add_quad(scene, walls, {-1, -1, 1}, {0, 2, 0}, {2, 0, 0});   // towards the camera
    add_quad(scene, walls, {-1, -1, -1}, {0, 2, 0}, {0, 0, 2});
    add_quad(scene, add_material(scene, one_sided(metal_material({0.9f, 0.9f, 0.9f}, 0))), {-1, -1, -1}, {2, 0, 0},
             {0, 2, 0});
    add_quad(scene, lamp, {-0.4f, 0.7f, -0.4f}, {0.8f, 0, 0}, {0, 0, 0.8f});
    add_quad(scene, screen, {0.1f, -0.9f, -0.3f}, {0.7f, 0, 0}, {0, 0.8f, 0});
    const int mirrored = add_quad(scene, screen, {0.1f, -0.9f, -0.1f}, {0.7f, 0, 0}, {0, 0.8f, 0});
    scene.instances[static_cast<std::size_t>(mirrored)].object_to_world[0][0] = -1;
    Material pane = glass_material(0);
    pane.thickness = 0;
    add_quad(scene, add_material(scene, pane), {-0.9f, -0.9f, 0.5f}, {0, 1.6f, 0}, {0.9f, 0, 0});
    scene.cameras = {look_at_camera({0.6, 0.9, 3.4}, {0, -0.1, 0}, {0, 1, 0}, 0.75)};
    for (const Backfaces backfaces : {Backfaces::automatic, Backfaces::cull})
        expect_agreement(scene, {.name = std::string("backfaces-") + name(backfaces), .backfaces = backfaces});
}

TEST_F(ImageTest, Panes) {
    // Clear, tinted, stacked, coated, blended, emissive, partly frosted and instanced panes between a sun, a lamp, a
    // sky and an emitter on one side, and diffuse, glossy and mirroring surfaces on the other.
    Scene scene;
    scene.environment.color = vec3(0.3f, 0.4f, 0.5f);
    scene.images.push_back({"frost", 2, 1, {255, 0, 0, 255, 255, 255, 0, 255}});  // roughness 0 and 1
    const int walls = add_material(scene, diffuse_material({0.7f, 0.6f, 0.5f}));
    add_quad(scene, add_material(scene, metal_material({0.8f, 0.8f, 0.8f}, 0.3f)), {-1, -1, -1}, {0, 0, 2}, {2, 0, 0});
    add_quad(scene, walls, {-1, -1, -1}, {2, 0, 0}, {0, 2, 0});
    add_quad(scene, walls, {1, -1, -1}, {0, 0, 2}, {0, 2, 0});
    add_quad(scene, add_material(scene, metal_material(vec3(0.9f), 0)), {0.1f, -0.9f, -0.9f}, {0.7f, 0, 0},
             {0, 0.8f, 0});
    add_box(scene, walls, {-0.5f, -0.98f, -0.4f}, {0, -0.5f, 0.1f});
    add_quad(scene, add_material(scene, light_material({4, 3, 2})), {-1.6f, -0.6f, -0.5f}, {0, 0, 0.8f}, {0, 0.7f, 0});
    Material clear = glass_material(0);
    clear.thickness = 0;
    Material tinted = clear, frosted = clear, coated = clear, blended = clear, lamp = clear;
    tinted.base_color = {0.9f, 0.5f, 0.2f, 1};
    frosted.metallic_roughness_texture.image = 0;
    frosted.metallic_roughness_texture.nearest = true;
    frosted.roughness = 0.5f, frosted.transmission = 0.8f;
    coated.clearcoat = 0.8f, coated.clearcoat_roughness = 0.2f, coated.metallic = 0.2f;
    coated.sheen_color = vec3(0.3f), coated.sheen_roughness = 0.6f;
    blended.alpha_mode = AlphaMode::blend, blended.base_color = {0.6f, 0.8f, 0.9f, 0.6f};
    lamp.emission = {0.5f, 0.2f, 0.1f}, lamp.transmission = 0.5f;
    const auto pane = [&](const Material& material, const vec3& corner, const vec3& u, const vec3& v) {
        return add_quad(scene, add_material(scene, material), corner, u, v);
    };
    pane(clear, {-1, -1, -1}, {0, 0, 1}, {0, 2, 0});
    pane(tinted, {-1, -1, 0}, {0, 0, 1}, {0, 2, 0});
    pane(lamp, {-1.1f, -0.2f, -0.2f}, {0, 0, 0.5f}, {0, 0.4f, 0});
    const int roof = pane(frosted, {-1, 1, -1}, {2, 0, 0}, {0, 0, 1});
    pane(coated, {-1, 1, 0}, {2, 0, 0}, {0, 0, 1});
    const int screen = pane(blended, {-0.4f, -0.9f, 0.4f}, {0.9f, 0, 0}, {0, 1.2f, 0});
    for (const double x : {-0.2, 0.1}) {  // the first one overlaps in the plane of the mesh
        scene.instances.push_back(scene.instances[static_cast<std::size_t>(screen)]);
        scene.instances.back().object_to_world[3] = dvec4(x, 0.9, 0.2 + x, 1);
    }
    Mesh& of_roof = scene.meshes[static_cast<std::size_t>(scene.instances[static_cast<std::size_t>(roof)].mesh)];
    of_roof.uvs[0] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    scene.lights.resize(2);
    scene.lights[0].intensity = {2, 1.5f, 1}, scene.lights[0].position = {0.3, 1.4, -0.4};
    scene.lights[1].type = LightType::directional, scene.lights[1].intensity = vec3(2);
    scene.lights[1].direction = glm::normalize(vec3(1, -0.8f, 0.3f));
    scene.cameras = {look_at_camera({0.6, 0.4, 3}, {0, -0.2, 0}, {0, 1, 0}, 0.75)};
    expect_agreement(scene, {.name = "panes"});
}

TEST_F(ImageTest, SolidPanes) {
    // Clear, absorbing, coated, partly opaque and open solids that light passes straight on, a shell around a lamp, an
    // object inside glass, a thin pane behind a solid one, and a solid that bends light. A sun, lamps without and with
    // a size, a sky and an emitter light diffuse, glossy and mirroring surfaces.
    Scene scene;
    scene.environment.color = vec3(0.3f, 0.4f, 0.5f);
    const int walls = add_material(scene, diffuse_material({0.7f, 0.6f, 0.5f}));
    add_quad(scene, add_material(scene, metal_material({0.8f, 0.8f, 0.8f}, 0.3f)), {-1, -1, -1}, {0, 0, 2}, {2, 0, 0});
    add_quad(scene, walls, {-1, -1, -1}, {2, 0, 0}, {0, 2, 0});
    add_quad(scene, walls, {1, -1, -1}, {0, 0, 2}, {0, 2, 0});
    add_quad(scene, add_material(scene, metal_material(vec3(0.9f), 0)), {0.1f, -0.9f, -0.9f}, {0.7f, 0, 0},
             {0, 0.8f, 0});
    add_quad(scene, add_material(scene, light_material({4, 3, 2})), {-1.6f, -0.6f, -0.5f}, {0, 0, 0.8f}, {0, 0.7f, 0});
    Material clear = glass_material(0);
    clear.straight_shadows = true;
    Material absorbing = clear, coated = clear, opaque = clear, bent = clear, thin = clear;
    absorbing.base_color = {0.9f, 0.8f, 0.7f, 1};
    absorbing.attenuation_color = {0.8f, 0.5f, 0.2f}, absorbing.attenuation_distance = 0.15f;
    coated.clearcoat = 0.8f, coated.clearcoat_roughness = 0.2f, coated.ior = 1.3f;
    opaque.transmission = 0.7f, opaque.metallic = 0.1f, opaque.specular = 0.6f;
    bent.straight_shadows = false;
    thin.thickness = 0, thin.base_color = {0.6f, 0.9f, 0.8f, 1};
    const int of_absorbing = add_material(scene, absorbing), of_clear = add_material(scene, clear);
    add_box(scene, of_clear, {-1.05f, -1, -1}, {-1, 1, 0});
    add_box(scene, of_absorbing, {-1.2f, -1, 0}, {-1, 1, 1});
    add_box(scene, add_material(scene, coated), {-1, 1, -1}, {1, 1.1f, 0});
    add_box(scene, add_material(scene, opaque), {-1, 1, 0}, {1, 1.1f, 1});
    add_quad(scene, add_material(scene, thin), {-1, 1.2f, -1}, {2, 0, 0}, {0, 0, 2});
    add_quad(scene, of_absorbing, {-0.9f, -0.9f, 0.9f}, {0.5f, 0, 0}, {0, 0.6f, 0});  // an open solid
    add_box(scene, add_material(scene, bent), {-0.2f, -0.98f, 0.3f}, {0.1f, -0.6f, 0.6f});
    add_box(scene, of_absorbing, {-0.7f, -0.98f, -0.6f}, {-0.2f, -0.3f, -0.1f});
    add_box(scene, walls, {-0.6f, -0.9f, -0.5f}, {-0.4f, -0.5f, -0.3f});
    add_box(scene, of_clear, {0.3f, 0.1f, -0.5f}, {0.7f, 0.5f, -0.1f});
    add_box(scene, of_clear, {0.65f, 0.15f, -0.45f}, {0.35f, 0.45f, -0.15f});  // the inside of the shell
    scene.lights.resize(3);
    scene.lights[0].intensity = {2, 1.5f, 1}, scene.lights[0].position = {0.3, 1.4, -0.4};
    scene.lights[1].type = LightType::directional, scene.lights[1].intensity = vec3(2);
    scene.lights[1].direction = glm::normalize(vec3(1, -0.8f, 0.3f));
    scene.lights[2].intensity = {0.2f, 0.3f, 0.3f}, scene.lights[2].position = {0.5, 0.3, -0.3};
    scene.lights[2].radius = 0.1f;
    scene.cameras = {look_at_camera({0.6, 0.4, 3}, {0, -0.2, 0}, {0, 1, 0}, 0.75)};
    expect_agreement(scene, {.name = "solid-panes"});
}

TEST_F(ImageTest, LightsWithASize) {
    // Balls, a spot and a sun with sizes light diffuse, glossy, mirroring and solid surfaces, around a blocker and
    // behind a pane, in front of an emitter and a sky. One ball holds a part of the floor. More lamps make a light
    // tree. The camera sees them in the second picture.
    Scene scene;
    scene.environment.color = vec3(0.1f, 0.2f, 0.3f);
    const int walls = add_material(scene, diffuse_material({0.7f, 0.6f, 0.5f}));
    add_quad(scene, add_material(scene, metal_material({0.8f, 0.8f, 0.8f}, 0.3f)), {-1, -1, -1}, {0, 0, 2}, {2, 0, 0});
    add_quad(scene, walls, {-1, -1, -1}, {2, 0, 0}, {0, 2, 0});
    add_quad(scene, add_material(scene, metal_material(vec3(0.9f), 0)), {-0.95f, -0.9f, -0.8f}, {0, 0, 1.4f},
             {0, 1.5f, 0});
    add_box(scene, walls, {-0.3f, -0.98f, -0.4f}, {0.2f, -0.5f, 0.1f});
    add_box(scene, add_material(scene, glass_material(0.2f)), {0.4f, -0.98f, 0.1f}, {0.7f, -0.6f, 0.4f});
    add_quad(scene, add_material(scene, light_material({2, 1, 1})), {0.2f, 0.3f, -0.95f}, {0.5f, 0, 0}, {0, 0.5f, 0});
    Material pane = glass_material(0);
    pane.thickness = 0, pane.base_color = {0.9f, 0.7f, 0.5f, 1};
    add_quad(scene, add_material(scene, pane), {0.9f, -1, -1}, {0, 0, 2}, {0, 2, 0});
    const auto lamp = [&](LightType type, const dvec3& at, const vec3& intensity) -> PunctualLight& {
        PunctualLight& light = scene.lights.emplace_back();
        light.type = type, light.position = at, light.intensity = intensity;
        return light;
    };
    lamp(LightType::point, {0.3, 0.4, -0.6}, {0.5f, 0.3f, 0.1f}).radius = 0.15f;
    lamp(LightType::point, {-0.6, -0.9, 0.5}, {0.02f, 0.05f, 0.02f}).radius = 0.2f;
    lamp(LightType::point, {1.3, 0.2, -0.2}, {0.6f, 0.6f, 0.8f}).radius = 0.1f;
    PunctualLight& spot = lamp(LightType::spot, {-0.2, 0.9, 0.3}, {1, 1, 2});
    spot.radius = 0.05f, spot.direction = glm::normalize(vec3(0.4f, -1, -0.2f)), spot.inner_cone = 0.2f;
    PunctualLight& sun = lamp(LightType::directional, dvec3(0), vec3(0.8f));
    sun.angle = 0.2f, sun.direction = glm::normalize(vec3(-0.6f, -0.8f, -0.5f));
    scene.cameras = {look_at_camera({0.6, 0.4, 3}, {0, -0.2, 0}, {0, 1, 0}, 0.75)};
    expect_agreement(scene, {.name = "sizes"});

    for (int i = 0; i < 12; ++i)
        lamp(LightType::point, {-0.9 + 0.15 * i, 0.5 + 0.1 * (i % 3), -0.8 + 0.3 * (i % 4)}, vec3(0.02f)).radius =
            i % 5 == 0 ? 0 : 0.01f * static_cast<float>(i);
    expect_agreement(scene, {.name = "sizes of many", .show_lamps = true});
}

TEST_F(ImageTest, DiffuseTransmission) {
    // Leaves and shades are lit from both sides by a map, triangle lights, a lamp and a sun.
    Scene scene = textured_scene();
    Material leaf = diffuse_material({0.3f, 0.6f, 0.2f}), shade = diffuse_material({0.8f, 0.7f, 0.6f});
    leaf.diffuse_transmission = 0.6f, leaf.diffuse_transmission_color = {0.7f, 0.9f, 0.1f};
    leaf.roughness = 0.5f, leaf.specular = 1;
    shade.diffuse_transmission = 1;
    Material candle = shade;
    candle.diffuse_transmission = 0.5f, candle.thickness = 1;
    candle.attenuation_color = {0.9f, 0.5f, 0.2f}, candle.attenuation_distance = 0.3f;
    Material frosted = candle;
    frosted.transmission = 0.5f, frosted.specular = 1, frosted.roughness = 0.6f, frosted.dispersion = 4;
    add_quad(scene, add_material(scene, leaf), {-1.8f, 0.9f, 0.6f}, {1.2f, 0, 0.4f}, {0, 0.9f, -0.2f});
    add_quad(scene, add_material(scene, shade), {0.5f, 1.1f, 0.4f}, {1.2f, 0.2f, 0}, {0, 0.7f, 0.3f});
    add_box(scene, add_material(scene, candle), {-0.5f, 0.02f, 0.9f}, {-0.1f, 0.8f, 1.3f});
    add_box(scene, add_material(scene, frosted), {0.1f, 0.02f, 0.9f}, {0.5f, 0.8f, 1.3f});
    for (Mesh& mesh : scene.meshes) {
        if (mesh.uvs[1].empty()) mesh.uvs[1] = mesh.uvs[0];
    }
    scene.lights.resize(2);
    scene.lights[0].intensity = {1, 1.2f, 1.5f}, scene.lights[0].position = {0.9, 1.5, 0.1};
    scene.lights[1].type = LightType::directional, scene.lights[1].intensity = vec3(1.5f);
    scene.lights[1].direction = glm::normalize(vec3(0.2f, -0.5f, 1));
    expect_agreement(scene, {.name = "diffuse-transmission", .bounces = 5});
}

TEST_F(ImageTest, BrushedAndDispersingSolids) {
    // The interface of a solid is isotropic and has no film; the metal and the opaque dielectric have both. Each path
    // has one colour channel from the first surface on that disperses light.
    Scene scene = studio();
    Material flint = glass_material(0, 1.6f);
    flint.dispersion = 3;
    add_ball(scene, add_material(scene, flint), {0, 0.4f, 1}, 0.35f);
    Material brushed = glass_material(0.4f);
    brushed.transmission = 0.6f, brushed.metallic = 0.3f;
    brushed.anisotropy_strength = 0.7f, brushed.anisotropy_rotation = 0.5f;
    brushed.iridescence = 0.8f, brushed.iridescence_ior = 1.6f;
    brushed.clearcoat = 0.5f, brushed.sheen_color = vec3(0.3f), brushed.sheen_roughness = 0.5f;
    Material dispersing = brushed;
    dispersing.dispersion = 8, dispersing.clearcoat = 0;
    dispersing.attenuation_color = {0.9f, 0.5f, 0.7f}, dispersing.attenuation_distance = 0.5f;
    add_box(scene, add_material(scene, brushed), {-1.2f, 0.05f, -0.4f}, {-0.3f, 0.9f, 0.4f});
    add_box(scene, add_material(scene, dispersing), {0.3f, 0.05f, -0.4f}, {1.1f, 0.8f, 0.4f});
    set_tangents(scene);
    expect_agreement(scene, {.name = "brushed-solids"});
}

TEST_F(ImageTest, SolidsOfLittleSpecularUnderACoat) {
    // The normal map tilts the interface so far that mirror directions of the coat fall below it.
    Scene scene = studio();
    scene.images.push_back({"tilted", 1, 1, {230, 128, 190, 255}});
    Material coated = glass_material(0.5f);
    coated.clearcoat = 1, coated.clearcoat_roughness = 0.3f;
    coated.specular = 0.3f;
    Material tinted = glass_material(0.4f, 2), dull = glass_material(0, 1.8f);
    tinted.specular_color = {0.8f, 0.4f, 0.1f}, tinted.transmission = 0.8f;
    dull.specular = 0;
    coated.normal_texture.image = 0;
    add_box(scene, add_material(scene, coated), {-1.2f, 0.05f, -0.4f}, {-0.3f, 0.9f, 0.4f});
    add_box(scene, add_material(scene, tinted), {0.3f, 0.05f, -0.4f}, {1.1f, 0.8f, 0.4f});
    add_ball(scene, add_material(scene, dull), {0, 0.4f, 1}, 0.35f);
    for (Mesh& mesh : scene.meshes) mesh.uvs[0].resize(mesh.positions.size());
    set_tangents(scene);
    expect_agreement(scene, {.name = "coated-solids"});
}

TEST_F(ImageTest, SmoothMeshesOfFewTriangles) {
    // The trough is concave: its normals are bent, and those of the balls start rays above the triangles.
    Scene scene = studio({4, 3.6f, 3}, 0.4f);
    Material coated = metal_material({0.7f, 0.3f, 0.2f}, 0.5f);
    coated.metallic = 0, coated.clearcoat = 0.8f, coated.clearcoat_roughness = 0.2f;
    Material brushed = metal_material({0.9f, 0.8f, 0.6f}, 0.3f);
    brushed.anisotropy_strength = 0.5f, brushed.anisotropy_rotation = 0.7f, brushed.clearcoat = 0.3f;
    Material pane = coated;
    pane.transmission = 0.6f;
    const int metal = add_material(scene, metal_material({0.8f, 0.8f, 0.9f}, 0.2f));
    add_smooth_ball(scene, add_material(scene, coated), {-1, 0.6f, 0}, 0.5f);
    add_smooth_ball(scene, add_material(scene, brushed), {1, 0.6f, 0}, 0.5f, 5);
    add_smooth_ball(scene, add_material(scene, pane), {1, 0.5f, 1.1f}, 0.3f, 5);
    const int ball = add_smooth_ball(scene, add_material(scene, diffuse_material(vec3(0.8f))), vec3(0), 0.5f);
    scene.instances[static_cast<std::size_t>(ball)].object_to_world =
        dmat4(dvec4(-1, 0, 0, 0), dvec4(0, 0.7, 0.3, 0), dvec4(0, -0.3, 1.1, 0), dvec4(0, 0.7, -0.6, 1));  // mirrors
    for (const int side : {-1, 1}) {
        const auto s = static_cast<float>(side);
        add_quad(scene, side < 0 ? metal : add_material(scene, brushed), {0, 0.1f, 0.5f}, {0.7f * s, 0.4f, 0},
                 {0, 0, 0.9f});
        for (std::size_t i = 0; i < 4; ++i) {
            const vec3 p = scene.meshes.back().positions[i];
            scene.meshes.back().normals[i] = glm::normalize(vec3(-1.2f * p.x, 1, 0));
        }
    }
    PunctualLight& sun = scene.lights.emplace_back();
    sun.type = LightType::directional;
    sun.direction = glm::normalize(vec3(1, -0.6f, -0.3f));
    sun.intensity = vec3(1);
    set_tangents(scene);
    expect_agreement(scene, {.name = "smooth", .samples = 256});
}

TEST_F(ImageTest, MaskAndBlend) {
    expect_agreement(curtain_scene(), {.name = "curtains", .bounces = 4});
}

TEST_F(ImageTest, Instances) {
    expect_agreement(instanced_scene(), {.name = "instances", .bounces = 4});
}

TEST_F(ImageTest, OrthographicFarFromTheOrigin) {
    Scene scene = instanced_scene();
    const dvec3 away(3e5, -1e5, 2e5);
    for (Instance& i : scene.instances) i.object_to_world[3] += dvec4(away, 0);
    for (PunctualLight& l : scene.lights) l.position += away;
    scene.cameras[1].camera_to_world[3] += dvec4(away, 0);
    expect_agreement(scene, {.name = "orthographic", .camera = scene.cameras[1], .bounces = 2});
}

/// Returns the scene's camera, focused at a distance through an aperture of so many millimetres.
Camera focused(Camera camera, double distance, const Lens& lens) {
    camera.lens = lens;
    camera.lens.focus = {.kind = Focus::Kind::distance, .distance = distance};
    return camera;
}

TEST_F(ImageTest, DepthOfField) {
    const Scene scene = load("cornell");
    expect_agreement(scene, {.name = "lens", .camera = focused(scene.cameras[0], 0.8, {.fstop = 0.5f})});
}

TEST_F(ImageTest, DepthOfFieldOfBlades) {
    Scene scene = load("still-life");
    expect_agreement(scene, {.name = "blades",
                             .camera = focused(scene.cameras[0], 1, {.aperture = 60, .blades = 5, .rotation = 25})});
}

TEST_F(ImageTest, DepthOfFieldOfAnOrthographicCamera) {
    const Scene scene = instanced_scene();
    expect_agreement(scene, {.name = "orthographic-lens",
                             .camera = focused(scene.cameras[1], 4, {.aperture = 400, .blades = 3}),
                             .bounces = 2});
}

}  // namespace
}  // namespace halflight::test
