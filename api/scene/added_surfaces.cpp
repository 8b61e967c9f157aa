#include "api/scene/added_surfaces.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <iterator>
#include <utility>

#include "engine/scene/area_light_shape.h"

namespace halflight {
namespace {

/// Returns the material of a light, or of the bodies behind lights. It does not reflect.
Material glowing(const std::string& name, const vec3& radiance) {
    Material material;
    material.name = name;
    material.base_color = vec4(0, 0, 0, 1);
    material.metallic = 0;
    material.specular = 0;
    material.emission = radiance;
    return material;
}

/// Appends triangles with normals of their own.
void append(const std::vector<vec3>& corners, std::uint32_t material, Mesh& mesh) {
    for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        const vec3 normal = glm::normalize(glm::cross(corners[i + 1] - corners[i], corners[i + 2] - corners[i]));
        mesh.positions.insert(mesh.positions.end(), {corners[i], corners[i + 1], corners[i + 2]});
        mesh.normals.insert(mesh.normals.end(), 3, normal);
        mesh.triangles.emplace_back(first, first + 1, first + 2);
        mesh.triangle_material.push_back(material);
    }
}

/// Returns the index of the first instance that was added.
std::size_t first_added(const Scene& scene) {
    std::size_t first = scene.instances.size();
    while (first > 0 && scene.instances[first - 1].added) --first;
    return first;
}

/// Moves the end of a list, from `first` on, to the end of another one.
template <class T>
void move_tail(std::vector<T>& from, std::size_t first, std::vector<T>& to) {
    const auto tail = from.begin() + static_cast<std::ptrdiff_t>(std::min(first, from.size()));
    std::move(tail, from.end(), std::back_inserter(to));
    from.erase(tail, from.end());
}

void move_added(Scene& from, const OwnParts& first, Scene& to) {
    move_tail(from.instances, first.instances, to.instances);
    move_tail(from.meshes, first.meshes, to.meshes);
    move_tail(from.materials, first.materials, to.materials);
}

}  // namespace

dmat4 transform_of(const AreaLamp& lamp) {
    const dvec3 z = -glm::normalize(dvec3(lamp.light.direction));
    const dvec3 side = glm::cross(dvec3(0, 1, 0), z);
    constexpr double kVertical = 1e-6;  // sine of the angle to the vertical below which X is the world's
    const dvec3 x = glm::length(side) > kVertical ? glm::normalize(side) : dvec3(1, 0, 0);
    const dvec3 y = glm::normalize(glm::cross(z, x));
    const double width{lamp.size.x}, height{lamp.size.y};
    return dmat4(dvec4(width * x, 0), dvec4(height * y, 0), dvec4(height * z, 0), dvec4(lamp.light.position, 1));
}

void add_area_lamps(const std::vector<AreaLamp>& lamps, Scene& scene) {
    const auto black = static_cast<std::uint32_t>(scene.materials.size());
    for (const AreaLamp& lamp : lamps) {
        const PunctualLight& light = lamp.light;
        if (light.intensity == vec3(0)) continue;
        if (scene.materials.size() == black) scene.materials.push_back(glowing("back of area lights", vec3(0)));
        const AreaLightShape shape = area_light_shape(lamp.disc);
        const auto front = static_cast<std::uint32_t>(scene.materials.size());
        Material& material = scene.materials.emplace_back(glowing(light.name, light.intensity));
        material.light_group = light.light_group;
        material.links = light.links;
        Instance& instance = scene.instances.emplace_back();
        instance.name = light.name;
        instance.mesh = static_cast<int>(scene.meshes.size());
        instance.object_to_world = transform_of(lamp);
        instance.added = true;
        Mesh& mesh = scene.meshes.emplace_back();
        mesh.name = light.name;
        append(shape.front, front, mesh);
        append(shape.body, black, mesh);
    }
}

std::vector<AreaLamp> area_lamps_of(const Scene& scene) {
    constexpr std::size_t kRectangle = 2;  // triangles of its front
    std::vector<AreaLamp> lamps;
    for (std::size_t i = first_added(scene); i < scene.instances.size(); ++i) {
        const Instance& instance = scene.instances[i];
        if (instance.catcher) continue;  // the ground
        const std::vector<std::uint32_t>& materials =
            scene.meshes[static_cast<std::size_t>(instance.mesh)].triangle_material;
        const Material& material = scene.materials[materials[0]];
        const dmat3 axes(instance.object_to_world);
        AreaLamp& lamp = lamps.emplace_back();
        lamp.light.name = instance.name;
        lamp.light.intensity = material.emission;
        lamp.light.position = dvec3(instance.object_to_world[3]);
        lamp.light.direction = -vec3(glm::normalize(axes[2]));
        lamp.light.light_group = material.light_group;
        lamp.light.links = material.links;
        lamp.disc = std::ranges::count(materials, materials[0]) > static_cast<std::ptrdiff_t>(kRectangle);
        lamp.size = vec2(glm::length(axes[0]), glm::length(axes[1]));
    }
    return lamps;
}

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

OwnParts own_parts(const Scene& scene) {
    OwnParts own{first_added(scene), scene.meshes.size(), scene.materials.size()};
    if (own.instances == scene.instances.size()) return own;
    own.meshes = static_cast<std::size_t>(scene.instances[own.instances].mesh);
    own.materials = std::ranges::min(scene.meshes[own.meshes].triangle_material);
    return own;
}

void remove_added(Scene& scene) {
    Scene added;
    move_added(scene, own_parts(scene), added);
}

WithoutAdded::WithoutAdded(Scene& scene) : scene_(scene) {
    move_added(scene, own_parts(scene), added_);
}

WithoutAdded::~WithoutAdded() {
    move_added(added_, {}, scene_);
}

}  // namespace halflight
