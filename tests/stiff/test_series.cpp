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
        Material material;
    };
    static std::vector<Family> families() {
        Material dielectric = metal_material(vec3(1), 0);
        dielectric.metallic = 0;
        std::vector<Family> all{{"metal", metal_material(vec3(1), 0)}};
        for (const float ior : {1.0f, 1.0001f, 1.5f, 2.5f}) {
            dielectric.ior = ior;
            all.push_back({fmt::format("dielectric, ior {}", ior), dielectric});
        }
        Material m = dielectric;
        m.specular = 0.4f;
        all.push_back({"specular 0.4, ior 2.5", m});
        m = dielectric;
        m.metallic = 0.5f;
        all.push_back({"half metallic", m});
        m = dielectric;
        m.ior = 1.5f;
        m.clearcoat = 0.9f;
        all.push_back({"clearcoat", m});
        m.transmission = 0.7f;
        all.push_back({"transmission under clearcoat", m});
        m.clearcoat = 0;
        all.push_back({"transmission", m});
        Material cloth = dielectric;
        cloth.ior = 1.5f;
        cloth.sheen_color = vec3(1);
        all.push_back({"sheen", cloth});
        cloth.transmission = 0.5f;
        cloth.clearcoat = 0.5f;
        all.push_back({"sheen under clearcoat, transmission", cloth});
        Material brushed = metal_material(vec3(1), 0);
        brushed.anisotropy_strength = 1;
        all.push_back({"anisotropy 1", brushed});
        brushed.anisotropy_strength = 0.3f;
        brushed.anisotropy_rotation = 1;
        all.push_back({"anisotropy 0.3", brushed});
        brushed.metallic = 0;
        brushed.transmission = 0.7f;
        all.push_back({"anisotropy 0.3, transmission", brushed});
        Material film = metal_material(vec3(1), 0);
        film.iridescence = 1;
        all.push_back({"thin film on metal", film});
        Material leaf = dielectric;
        for (const float ior : {1.0f, 1.5f, 20.0f}) {
            for (const float through : {0.5f, 1.0f}) {
                leaf.ior = ior;
                leaf.diffuse_transmission = through;
                all.push_back({fmt::format("diffuse transmission {}, ior {}", through, ior), leaf});
            }
        }
        leaf.ior = 1.5f;
        leaf.diffuse_transmission = 0.5f;
        leaf.transmission = 0.5f;
        all.push_back({"diffuse transmission and transmission", leaf});
        leaf.thickness = 1;
        leaf.metallic = 0.3f;
        all.push_back({"diffuse transmission of solids", leaf});
        leaf.transmission = 0;
        leaf.clearcoat = 0.5f;
        all.push_back({"diffuse transmission of solids under clearcoat", leaf});
        m.transmission = 1;
        m.ior = 1;
        all.push_back({"all transmission, ior 1", m});
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
                m.roughness = m.clearcoat_roughness = m.sheen_roughness = kRoughnesses[column];
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
            double worst = 0, bound = 1;
            for (int column = 0; column < columns; ++column) {
                const MeanValue found =
                    mean_of(seen, kPatch * column, kPatch * (column + 1), kPatch * row, kPatch * (row + 1));
                EXPECT_LE(found.error, 0.005) << all[static_cast<std::size_t>(row)].name << ", column " << column;
                const double off = std::abs(found.value - 1), allowed = 4 * found.error + 2e-4;
                if (off / allowed >= worst / bound) worst = off, bound = allowed;
            }
            expect(fmt::format("white furnace at {:.0f} degrees: {}", elevation * 180 / kPi,
                               all[static_cast<std::size_t>(row)].name),
                   worst, bound, "radiance",
                   "worst of roughness 0, 1e-4, 1e-2, 0.1, 1: four standard errors, and the albedo table's 2e-4");
        }
    }
}

}  // namespace
}  // namespace halflight::test
