#include "tools/measure/bench/look.h"

#include <algorithm>

namespace halflight::bench {
namespace {

/// Alone under the lights that are left: nothing shines by itself.
Look dark(const Scene& scene) {
    Look look{scene.materials, {}, {}};
    for (Material& m : look.materials) {
        m.emission = vec3(0);
        m.unlit = false;
    }
    return look;
}

/// Lights as they are, a base of one kind only.
Look made_of(const Scene& scene, float metallic, float roughness, float specular) {
    Look look = look_of(scene);
    for (Material& m : look.materials) {
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
    return look;
}

}  // namespace

Look look_of(const Scene& scene) {
    return {scene.materials, scene.lights, scene.environment};
}

void wear(Scene& scene, const Look& look) {
    scene.materials = look.materials;
    scene.lights = look.lights;
    scene.environment = look.environment;
}

Look lit_by_one_point(const Scene& scene, const dvec3& fallback) {
    Look look = dark(scene);
    const auto directional =
        std::ranges::find(scene.lights, LightType::directional, [](const PunctualLight& l) { return l.type; });
    if (directional != scene.lights.end()) {
        look.lights = {*directional};
    } else if (!scene.lights.empty()) {
        look.lights = {scene.lights.front()};
    } else {
        look.lights.emplace_back();
        look.lights.front().position = fallback;
    }
    return look;
}

Look lit_by_areas(const Scene& scene) {
    return {scene.materials, {}, {}};
}

Look made_of_metal(const Scene& scene) {
    return made_of(scene, 1, 0.2f, 1);
}

Look made_diffuse(const Scene& scene) {
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
