#include "tools/measure/bench/appearance.h"

#include <algorithm>

namespace halflight::bench {
namespace {

/// Returns materials without emission, and no lights.
Appearance dark(const Scene& scene) {
    Appearance appearance{scene.materials, {}, {}};
    for (Material& m : appearance.materials) {
        m.emission = vec3(0);
        m.unlit = false;
    }
    return appearance;
}

/// Returns the scene's lights, and materials with a single lobe.
Appearance made_of(const Scene& scene, float metallic, float roughness, float specular) {
    Appearance appearance = appearance_of(scene);
    for (Material& m : appearance.materials) {
        Material plain;
        plain.name = m.name;
        plain.normal_texture = m.normal_texture;
        plain.normal_scale = m.normal_scale;
        plain.base_color = vec4(0.8f, 0.8f, 0.8f, 1);
        plain.metallic = metallic;
        plain.roughness = roughness;
        plain.specular = specular;
        m = plain;
    }
    return appearance;
}

}  // namespace

Appearance appearance_of(const Scene& scene) {
    return {scene.materials, scene.lights, scene.environment};
}

void set_appearance(Scene& scene, const Appearance& appearance) {
    scene.materials = appearance.materials;
    scene.lights = appearance.lights;
    scene.environment = appearance.environment;
}

Appearance lit_by_one_point(const Scene& scene, const dvec3& fallback) {
    Appearance appearance = dark(scene);
    const auto directional =
        std::ranges::find(scene.lights, LightType::directional, [](const PunctualLight& l) { return l.type; });
    if (directional != scene.lights.end()) {
        appearance.lights = {*directional};
    } else if (!scene.lights.empty()) {
        appearance.lights = {scene.lights.front()};
    } else {
        appearance.lights.emplace_back();
        appearance.lights.front().position = fallback;
    }
    return appearance;
}

Appearance lit_by_areas(const Scene& scene) {
    return {scene.materials, {}, {}};
}

Appearance made_of_metal(const Scene& scene) {
    return made_of(scene, 1, 0.2f, 1);
}

Appearance made_diffuse(const Scene& scene) {
    return made_of(scene, 0, 1, 0);
}

void add_square(Scene& scene, const dvec3& centre, double side) {
    const auto material = static_cast<std::uint32_t>(scene.materials.size());
    const auto half = static_cast<float>(0.5 * side);
    scene.materials.emplace_back();
    scene.materials.back().emission = vec3(1);
    Mesh square;
    square.positions = {{-half, 0, -half}, {half, 0, -half}, {half, 0, half}, {-half, 0, half}};
    square.normals.assign(4, vec3(0, -1, 0));
    square.triangles = {{0, 1, 2}, {0, 2, 3}};
    square.triangle_material = {material, material};
    Instance instance;
    instance.mesh = static_cast<int>(scene.meshes.size());
    instance.object_to_world[3] = dvec4(centre, 1);
    scene.meshes.push_back(std::move(square));
    scene.instances.push_back(std::move(instance));
}

void remove_square(Scene& scene) {
    scene.instances.pop_back();
    scene.meshes.pop_back();
}

}  // namespace halflight::bench
