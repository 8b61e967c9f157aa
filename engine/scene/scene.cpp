#include "engine/scene/scene.h"

#include <algorithm>

#include "engine/scene/geometry.h"

namespace halflight {

WorldBounds world_bounds(const Scene& scene) {
    std::vector<Bounds> boxes(scene.meshes.size());
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        for (const vec3& p : scene.meshes[i].positions) boxes[i].add(p);
    }
    WorldBounds bounds = scene.paged_bounds.value_or(WorldBounds());
    for (const Instance& instance : scene.instances) {
        if (instance.added) continue;
        const Bounds& box = boxes[static_cast<std::size_t>(instance.mesh)];
        if (box.empty() || !leaves_area(instance.object_to_world)) continue;
        const dmat4& m = instance.object_to_world;
        // Bounds the transformed box, one axis at a time (Arvo, Graphics Gems 1990).
        dvec3 lower(m[3]), upper(m[3]);
        for (int axis = 0; axis < 3; ++axis) {
            const dvec3 a = dvec3(m[axis]) * double(box.lower[axis]), b = dvec3(m[axis]) * double(box.upper[axis]);
            lower += glm::min(a, b);
            upper += glm::max(a, b);
        }
        bounds.lower = glm::min(bounds.lower, lower);
        bounds.upper = glm::max(bounds.upper, upper);
    }
    return bounds;
}

std::uint64_t passed_classes(const Scene& scene) {
    std::uint64_t stopping = scene.environment.links.blockers;
    for (const auto& light : scene.lights) stopping &= light.links.blockers;
    for (const auto& material : scene.materials) stopping &= material.links.blockers;
    for (const auto& instance : scene.instances) stopping &= instance.links.blockers;
    return ~stopping;
}

bool has_light(const Scene& scene) {
    if (!scene.environment.black()) return true;
    const auto shines = [](const PunctualLight& l) { return glm::any(glm::greaterThan(l.intensity, vec3(0))); };
    if (std::ranges::any_of(scene.lights, shines)) return true;
    const auto bright = [&](std::uint32_t index) {
        const Material& m = scene.materials[index];
        return has_emission(m) || (m.unlit && glm::any(glm::greaterThan(vec3(m.base_color), vec3(0))));
    };
    return std::ranges::any_of(scene.instances, [&](const Instance& instance) {
        return std::ranges::any_of(scene.meshes[static_cast<std::size_t>(instance.mesh)].triangle_material, bright);
    });
}

Environment default_sky() {
    Environment sky;
    sky.name = "neutral sky";
    sky.color = vec3(1);
    sky.map = Image(64, 32, 3);
    for (int y = 0; y < sky.map.height; ++y) {
        const double elevation = std::cos(kPi * (y + 0.5) / sky.map.height);  // sine of the angle above the horizon
        const double radiance = 9.0 / 7.0 * (1 + 2 * std::max(elevation, 0.0)) / 3;
        std::fill_n(sky.map.at(0, y), 3 * sky.map.width, static_cast<float>(radiance));
    }
    return sky;
}

}  // namespace halflight
