// Tests slowly converging series and white furnaces: closed rooms against the sum of their bounces, and white surfaces
// under a white sky.
#include <algorithm>
#include <cmath>

#include "tests/stiff/stiff.h"

namespace halflight::test {
namespace {

class Series : public StiffTest {
  protected:
    static constexpr int kPatch = 8;  // pixels per side
    static constexpr float kRoughnesses[] = {0, 1e-4f, 1e-2f, 0.1f, 1};

    /// Returns the radiance of bounces 0 to `bounces` in a closed room of emission 1.
    static double truncated(double albedo, int bounces) {
        return albedo == 1 ? bounces + 1 : (1 - std::pow(albedo, bounces + 1)) / (1 - albedo);
    }

    struct Family {
        std::string name;
        Material material;  // takes the roughnesses of the patch, apart from a clearcoat_roughness above 0
    };
    static std::vector<Family> families() {
        std::vector<Family> all;
        // Adds a family that differs from `base`; returns its material.
        const auto add = [&](const std::string& name, Material base, const auto& change) {
            change(base);
            all.push_back({name, base});
            return base;
        };
        const auto nothing = [](Material&) {};
        const Material metal = add("metal", metal_material(vec3(1), 0), nothing);
        add("diffuse", diffuse_material(vec3(1)), nothing);
        for (const float ior : {1.0f, 1.0001f, 1.5f, 2.5f})
            add(fmt::format("dielectric, ior {}", ior), metal, [&](Material& m) { m.metallic = 0, m.ior = ior; });
        Material dense = metal, plain = metal;
        dense.metallic = 0, dense.ior = 2.5f;
        plain.metallic = 0, plain.ior = 1.5f;
        add("specular 0.4, ior 2.5", dense, [](Material& m) { m.specular = 0.4f; });
        add("half metallic", dense, [](Material& m) { m.metallic = 0.5f; });
        const Material coated = add("clearcoat", plain, [](Material& m) { m.clearcoat = 0.9f; });
        add("clearcoat of roughness 0.3", coated, [](Material& m) { m.clearcoat_roughness = 0.3f; });
        add("transmission under clearcoat", coated, [](Material& m) { m.transmission = 0.7f; });
        add("transmission", plain, [](Material& m) { m.transmission = 0.7f; });
        add("all transmission, ior 1", plain, [](Material& m) { m.transmission = 1, m.ior = 1; });
        const Material cloth = add("sheen", plain, [](Material& m) { m.sheen_color = vec3(1); });
        add("sheen under clearcoat, transmission", cloth, [](Material& m) { m.transmission = m.clearcoat = 0.5f; });
        add("anisotropy 1", metal, [](Material& m) { m.anisotropy_strength = 1; });
        const Material brushed = add("anisotropy 0.3", metal, [](Material& m) {
            m.anisotropy_strength = 0.3f;
            m.anisotropy_rotation = 1;
        });
        add("anisotropy 0.3, transmission", brushed, [](Material& m) { m.metallic = 0, m.transmission = 0.7f; });
        add("thin film on metal", metal, [](Material& m) { m.iridescence = 1; });
        for (const float ior : {1.0f, 1.5f, 20.0f})
            for (const float through : {0.5f, 1.0f})
                add(fmt::format("diffuse transmission {}, ior {}", through, ior), plain, [&](Material& m) {
                    m.ior = ior;
                    m.diffuse_transmission = through;
                });
        const Material leaf = add("diffuse transmission and transmission", plain,
                                  [](Material& m) { m.diffuse_transmission = m.transmission = 0.5f; });
        const Material solid = add("diffuse transmission of solids", leaf, [](Material& m) {
            m.thickness = 1;
            m.metallic = 0.3f;
        });
        add("diffuse transmission of solids under clearcoat", solid, [](Material& m) {
            m.transmission = 0;
            m.clearcoat = 0.5f;
        });
        return all;
    }
};

TEST_F(Series, ClosedRooms) {
    for (const float albedo : {0.9f, 0.99f, 0.999f, 1.0f}) {
        Material glowing = diffuse_material(vec3(albedo));
        glowing.emission = vec3(1);
        const Scene scene = closed_box(glowing);
        const ReferenceScene oracle(scene);
        for (const int bounces : {3, 64}) {
            const double exact = truncated(albedo, bounces);
            expect_mean(fmt::format("closed room of albedo {}, {} bounces", albedo, bounces),
                        mean_of(picture(scene, camera_in_box(), 24, 64, bounces)), exact);
            ReferenceSettings settings;
            settings.width = settings.height = 16;
            settings.samples = bounces > 10 ? 160 : 64;
            settings.bounces = bounces;
            settings.camera = camera_in_box();
            expect_mean(fmt::format("closed room of albedo {}, {} bounces, oracle", albedo, bounces),
                        mean_of(render_reference(oracle, settings)), exact);
        }
    }
}

// A film on a white dielectric reflects some colours less than others, so the albedo is only known to be at most 1.
TEST_F(Series, ThinFilms) {
    Scene scene;
    scene.environment.color = vec3(1);
    int columns = 0;
    for (const float ior : {1.0f, 1.3f, 20.0f}) {
        for (const float thickness : {0.0f, 300.0f, 1e6f}) {
            for (const float metallic : {0.0f, 1.0f}) {
                for (const float roughness : {0.0f, 0.3f, 1.0f}) {
                    Material m = metal_material(vec3(1), roughness);
                    m.metallic = metallic;
                    m.ior = 1.5f;
                    m.iridescence = 1;
                    m.iridescence_ior = ior;
                    m.iridescence_thickness_maximum = thickness;
                    add_quad(scene, add_material(scene, m), {static_cast<float>(columns++), 0, 0}, {0, 0, 2},
                             {1, 0, 0});
                }
            }
        }
    }
    const dvec3 centre(0.5 * columns, 0, 1);
    Camera camera = look_at_camera(centre + 1000.0 * dvec3(0, 0.5, std::sqrt(0.75)), centre, {0, 1, 0}, 1);
    camera.orthographic = true;
    camera.ortho_height = 1;
    const RenderResult seen = picture(scene, small_settings(camera, kPatch * columns, kPatch, 640, 1));
    double most = 0, least = 1;
    for (int column = 0; column < columns; ++column) {
        const MeanValue found = mean_of(seen, kPatch * column, kPatch * (column + 1), 0, kPatch);
        most = std::max(most, found.value - 4 * found.error);
        least = std::min(least, found.value + 4 * found.error);
    }
    expect("white surfaces under thin films: gain", most - 1, 0.02, "radiance",
           "the mean reflectance of a rough lobe is that of one cosine");
    expect("white surfaces under thin films: loss", 1 - least, 0.7, "radiance", "interference takes some colours away");
}

TEST_F(Series, WhiteFurnace) {
    for (const double elevation : {kPi / 2, std::asin(0.05)}) {
        // Each family has a row of patches. All patches are in one plane under a sky of 1, so that none sees another.
        // Seen from its elevation, each patch is square.
        Scene scene;
        scene.environment.color = vec3(1);
        const auto length = static_cast<float>(1 / std::sin(elevation));
        const std::vector<Family> all = families();
        for (std::size_t row = 0; row < all.size(); ++row) {
            for (std::size_t column = 0; column < std::size(kRoughnesses); ++column) {
                Material m = all[row].material;
                m.roughness = m.sheen_roughness = kRoughnesses[column];
                if (m.clearcoat_roughness == 0) m.clearcoat_roughness = kRoughnesses[column];
                add_quad(scene, add_material(scene, m),
                         {static_cast<float>(column), 0, static_cast<float>(row) * length}, {0, 0, length}, {1, 0, 0});
                scene.meshes.back().tangents.assign(4, vec4(1, 0, 0, 1));
            }
        }
        const int columns = static_cast<int>(std::size(kRoughnesses)), rows = static_cast<int>(all.size());
        const dvec3 centre(0.5 * columns, 0, 0.5 * rows * length);
        Camera camera = look_at_camera(centre + 1000.0 * dvec3(0, std::sin(elevation), std::cos(elevation)), centre,
                                       {0, std::cos(elevation), -std::sin(elevation)}, 1);
        camera.orthographic = true;
        camera.ortho_height = rows;
        const RenderResult seen = picture(scene, small_settings(camera, kPatch * columns, kPatch * rows, 640, 1));
        for (int row = 0; row < rows; ++row) {
            Worst worst;
            for (int column = 0; column < columns; ++column) {
                const MeanValue found =
                    mean_of(seen, kPatch * column, kPatch * (column + 1), kPatch * row, kPatch * (row + 1));
                EXPECT_LE(found.error, 0.005) << all[static_cast<std::size_t>(row)].name << ", column " << column;
                worst.add(std::abs(found.value - 1), 4 * found.error + 2e-4);
            }
            expect(fmt::format("white furnace at {:.0f} degrees: {}", elevation * 180 / kPi,
                               all[static_cast<std::size_t>(row)].name),
                   worst.figure, worst.bound, "radiance",
                   "worst of roughness 0, 1e-4, 1e-2, 0.1, 1: four standard errors, and the albedo table's 2e-4");
        }
    }
}

}  // namespace
}  // namespace halflight::test
