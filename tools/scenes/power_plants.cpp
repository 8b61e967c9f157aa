#include "tools/scenes/power_plants.h"

#include <algorithm>

namespace halflight::scenes {
namespace {

constexpr int kSide = 4;             // plants along each side of the square
constexpr double kPlantPitch = 150;  // metres

std::vector<Material> power_plant_materials() {
    return {matte("ground", {0.30, 0.27, 0.22}),
            glossy("road", dvec3(0.09), 0.8),
            matte("concrete", {0.36, 0.35, 0.33}),
            glossy("dark steel", {0.20, 0.22, 0.25}, 0.5),
            glossy("red primer", {0.30, 0.10, 0.07}, 0.6),
            metal("galvanized steel", {0.58, 0.60, 0.61}, 0.45),
            glossy("yellow paint", {0.75, 0.52, 0.04}, 0.4),
            glossy("boiler tube", {0.16, 0.12, 0.10}, 0.55),
            glossy("cladding", {0.36, 0.44, 0.52}, 0.5),
            metal("pipe jacket", {0.80, 0.80, 0.81}, 0.3),
            glossy("green paint", {0.06, 0.28, 0.14}, 0.4),
            glossy("red paint", {0.50, 0.04, 0.03}, 0.4),
            glossy("blue paint", {0.05, 0.14, 0.40}, 0.4),
            glossy("white paint", {0.76, 0.75, 0.72}, 0.45),
            metal("bolts", {0.45, 0.44, 0.42}, 0.4),
            glossy("ceramic", {0.28, 0.12, 0.06}, 0.15),
            matte("coal", dvec3(0.04)),
            matte("rubber", dvec3(0.03)),
            light("lamp", {14, 12.6, 10})};
}

dmat4 plant_frame(int i, int j) {
    return move(kPlantPitch * (i - 0.5 * (kSide - 1)), 0, kPlantPitch * (j - 0.5 * (kSide - 1)));
}

void add_views(Document& document, const Bounds&) {
    MeshBuilder land("land");
    constexpr double kFar = 1500, kEdge = 0.5 * kSide * kPlantPitch;
    const auto flat = [&](PlantMaterial material, double x0, double x1, double z0, double z1, double y) {
        land.material(static_cast<int>(material)).quad({x0, y, z1}, {x1, y, z1}, {x1, y, z0}, {x0, y, z0});
    };
    flat(PlantMaterial::ground, -kFar, kFar, -kFar, kFar, -0.05);
    for (int i = 0; i <= kSide; ++i) {  // roads around the plants, the ones along x a little higher
        const double at = kPlantPitch * (i - 0.5 * kSide);
        flat(PlantMaterial::road, at - 4, at + 4, -kEdge - 4, kEdge + 4, 0);
        flat(PlantMaterial::road, -kEdge - 4, kEdge + 4, at - 4, at + 4, 0.01);
    }
    document.node("land", document.mesh(land.take()));
    document.sun("sun", {-0.5, 0.62, 0.6}, {1, 0.92, 0.80}, 5.5);
    document.sky({0.45, 0.6, 0.84});
    for (int i = 0; i < kSide; ++i)
        for (int j = 0; j < kSide; ++j)
            for (const double y : {1.0, 4.0})
                for (const double x : {-11.0, 11.0})
                    document.lamp("lamp", dvec3(plant_frame(i, j)[3]) + dvec3(x, y * kLevel - 0.6, 11), {1, 0.9, 0.75},
                                  60, 180);
    // Inside the boiler house of the plant at the near corner, and above all plants.
    const dvec3 plant(plant_frame(1, 1)[3]);
    document.camera("inside", plant + dvec3(-13.4, 2 * kLevel + 1.7, 13.2), plant + dvec3(6, 2 * kLevel + 2.6, 5), 62,
                    16.0 / 9);
    document.camera("air", {-420, 250, 520}, {0, 10, 20}, 38, 16.0 / 9);
}

}  // namespace

void rect_duct(MeshBuilder& mesh, std::span<const dvec3> path, const dvec3& normal, double width, double height,
               double rib_distance) {
    const std::vector<dvec2> outline = bar_section(width, height);
    const std::size_t last = path.size() - 1;
    const auto along = [&](std::size_t k) { return glm::normalize(path[k + 1] - path[k]); };
    for (std::size_t k = 0; k < last; ++k) {
        const dmat4 frame = frame_at(path[k], along(k), normal);
        const auto corner = [&](std::size_t end, const dvec2& p) {  // on the plane that halves the bend
            const dvec3 z = along(k), offset(frame * dvec4(p, 0, 0));
            const dvec3 cut = z + along(end == 0 || end == last ? k : end == k ? k - 1 : k + 1);
            return path[end] + offset - z * (glm::dot(offset, cut) / glm::dot(z, cut));
        };
        for (std::size_t e = 0; e < 4; ++e) {
            const dvec2 a = outline[e], b = outline[(e + 1) % 4];
            mesh.quad(corner(k, a), corner(k, b), corner(k + 1, b), corner(k + 1, a));
        }
        if (rib_distance <= 0) continue;
        const double length = glm::length(path[k + 1] - path[k]), margin = 0.6 * std::max(width, height);
        const Local place(mesh, frame);
        const double x = width / 2, y = height / 2, deep = 0.12;
        for (double z = k == 0 ? 0.3 : margin; z < length - (k + 1 == last ? 0.3 : margin); z += rib_distance) {
            mesh.box({-x - deep, y - 0.01, z}, {x + deep, y + deep, z + 0.1});
            mesh.box({-x - deep, -y - deep, z}, {x + deep, -y + 0.01, z + 0.1});
            mesh.box({-x - deep, -y + 0.01, z}, {-x + 0.01, y - 0.01, z + 0.1},
                     MeshBuilder::kTop | MeshBuilder::kBottom);
            mesh.box({x - 0.01, -y + 0.01, z}, {x + deep, y - 0.01, z + 0.1}, MeshBuilder::kTop | MeshBuilder::kBottom);
        }
    }
}

std::uint64_t write_power_plants(const std::filesystem::path& path, const SceneOptions& options) {
    const auto make = [](double level) {
        Assembly all{.name = "power plants",
                     .group = "section",
                     .materials = power_plant_materials(),
                     .models = {},
                     .places = {}};
        all.add_views = add_views;
        Plant plant{all, Detail{level}};
        add_boiler_house(plant);
        add_boiler(plant);
        add_yard(plant);
        add_turbine_hall(plant);
        for (int i = 0; i < kSide; ++i)
            for (int j = 0; j < kSide; ++j)
                for (const auto& [model, matrix] : plant.places) all.place(model, plant_frame(i, j) * matrix);
        return all;
    };
    return write_assembly(path, fitted(options.triangles, make), options);
}

}  // namespace halflight::scenes
