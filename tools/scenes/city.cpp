// Writes the city. Only the models, the plan and the JSON are in memory.
#include "tools/scenes/city.h"

#include <algorithm>

#include "tools/scenes/city_buildings.h"

namespace halflight::scenes {
namespace {

constexpr std::uint64_t kLandTriangles = 2;
constexpr int kLandMaterial = static_cast<int>(CityMaterial::grass);

/// Adds sun, sky, cameras, and the land around the city. Cameras look at the crossing at the origin and along the
/// street that starts there.
void add_views(Document& document, const Bounds& bounds) {
    MeshBuilder land("land");
    const double out = 1.5 * std::max(bounds.upper.x - bounds.lower.x, bounds.upper.z - bounds.lower.z);
    land.material(kLandMaterial).quad({-out, -0.05, out}, {out, -0.05, out}, {out, -0.05, -out}, {-out, -0.05, -out});
    document.node("land", document.mesh(land.take()));
    const double reach = std::min<double>(std::max(bounds.upper.x, bounds.upper.z), 500);
    document.sun("sun", {-0.55, 0.78, 0.16}, {1, 0.92, 0.80}, 10);
    document.sky({0.8, 1.05, 1.45});
    document.camera("street", {-4.5, 1.7, 3.5}, {30, 5.5, 0.5}, 55, 16.0 / 9);
    document.camera("aerial", {-0.75 * reach, 60 + 0.35 * reach, 0.95 * reach}, {0.1 * reach, 0, -0.05 * reach}, 38,
                    16.0 / 9);
}

void add_instances(Document& document, const std::vector<CityModel>& models, const std::vector<Placement>& plan,
                   bool gpu_instancing) {
    static constexpr double kHalf = 0.70710678118654752;  // quarter turns about +y as quaternions (y, w)
    static constexpr dvec2 kTurn[] = {{0, 1}, {kHalf, kHalf}, {1, 0}, {-kHalf, kHalf}};
    std::vector<int> meshes(models.size(), kNothing);
    for (const Placement& p : plan)
        if (meshes[p.model] == kNothing) meshes[p.model] = document.mesh(models[p.model].mesh);
    if (!gpu_instancing) {
        for (const Placement& p : plan)
            document.node(models[p.model].mesh.name, meshes[p.model],
                          move(p.x, 0, p.z) * turn_y(90.0 * p.quarter_turns));
        return;
    }
    for (std::uint32_t model = 0; model < models.size(); ++model) {
        if (meshes[model] == kNothing) continue;
        std::vector<vec3> translations;
        std::vector<vec4> rotations;
        for (const Placement& p : plan) {
            if (p.model != model) continue;
            translations.emplace_back(p.x, 0, p.z);
            rotations.emplace_back(0, kTurn[p.quarter_turns].x, 0, kTurn[p.quarter_turns].y);
        }
        document.instances(models[model].mesh.name, meshes[model], std::move(translations), std::move(rotations));
    }
}

}  // namespace

std::uint64_t write_city(const std::filesystem::path& path, const SceneOptions& options) {
    const std::vector<CityModel> models = city_models();
    const std::vector<Placement> plan =
        city_plan(models, options.triangles - std::min(options.triangles, kLandTriangles));
    Assembly city{.name = "city", .group = "district", .materials = city_materials(), .models = {}, .places = {}};
    city.add_views = add_views;
    for (const CityModel& model : models) city.add(model.mesh.name, [&model] { return model.mesh; });
    for (const Placement& p : plan) city.place(p.model, move(p.x, 0, p.z) * turn_y(90.0 * p.quarter_turns));
    if (options.flatten) return write_assembly(path, city, options);
    Document document(city.name);
    for (const Material& material : city.materials) document.material(material);
    add_views(document, bounds_of(city));
    add_instances(document, models, plan, options.gpu_instancing);
    document.write(path);
    return document.triangles();
}

}  // namespace halflight::scenes
