#include "api/scene/ground.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

namespace halflight {

void add_ground(Scene& scene, const WorldBounds& bounds, const std::optional<double>& wanted) {
    if (bounds.empty()) return;
    Mesh square;
    square.name = "ground";
    square.positions = {{-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}};
    square.normals.assign(4, vec3(0, 1, 0));
    square.triangles = {{0, 1, 2}, {0, 2, 3}};
    square.triangle_material.assign(2, static_cast<std::uint32_t>(scene.materials.size()));
    Material material;
    material.name = "ground";
    material.base_color = vec4(vec3(0.35f), 1);  // under the neutral sky as bright as its horizon
    material.roughness = 1;
    material.metallic = 0;
    const dvec3 extent = bounds.upper - bounds.lower;
    const double size = std::max({extent.x, extent.y, extent.z, 1e-6});
    const double height = wanted.value_or(bounds.lower.y - 1e-4 * size);  // not within a floor of the scene
    const double reach = 20 * std::max(size, bounds.upper.y - height);
    const dvec3 centre(0.5 * (bounds.lower.x + bounds.upper.x), height, 0.5 * (bounds.lower.z + bounds.upper.z));
    Instance& instance = scene.instances.emplace_back();
    instance.name = "ground";
    instance.mesh = static_cast<int>(scene.meshes.size());
    instance.object_to_world = glm::scale(glm::translate(dmat4(1), centre), dvec3(reach, 1, reach));
    instance.catcher = true;
    instance.added = true;
    scene.meshes.push_back(std::move(square));
    scene.materials.push_back(std::move(material));
}

namespace {

bool has_ground(const Scene& scene) {
    return !scene.instances.empty() && scene.instances.back().added;
}

}  // namespace

WithoutGround::WithoutGround(Scene& scene) : scene_(scene) {
    if (!has_ground(scene)) return;
    ground_.instances.push_back(std::move(scene.instances.back()));
    ground_.meshes.push_back(std::move(scene.meshes.back()));
    ground_.materials.push_back(std::move(scene.materials.back()));
    scene.instances.pop_back(), scene.meshes.pop_back(), scene.materials.pop_back();
}

WithoutGround::~WithoutGround() {
    if (ground_.instances.empty()) return;
    scene_.instances.push_back(std::move(ground_.instances[0]));
    scene_.meshes.push_back(std::move(ground_.meshes[0]));
    scene_.materials.push_back(std::move(ground_.materials[0]));
}

void remove_ground(Scene& scene) {
    if (!has_ground(scene)) return;
    scene.instances.pop_back();
    scene.meshes.pop_back();
    scene.materials.pop_back();
}

}  // namespace halflight
