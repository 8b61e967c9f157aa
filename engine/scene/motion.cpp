#include "engine/scene/motion.h"

#include <map>
#include <string_view>
#include <tuple>
#include <utility>

namespace halflight {
namespace {

const Mesh& mesh_of(const Scene& scene, const Instance& instance) {
    return scene.meshes[static_cast<std::size_t>(instance.mesh)];
}

/// Identity of an instance: its node, or its name if an edit has added it, and its index among the instances of that
/// node or name (EXT_mesh_gpu_instancing makes many).
using Key = std::tuple<int, std::string_view, int>;

template <class F>
void for_each_key(const Scene& scene, F f) {
    std::map<std::pair<int, std::string_view>, int> seen;
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        const Instance& instance = scene.instances[i];
        const std::string_view name = instance.added ? std::string_view(instance.name) : std::string_view();
        f(Key(instance.node, name, seen[{instance.node, name}]++), i);
    }
}

}  // namespace

PreviousSurfaces::PreviousSurfaces(const Scene& now, Scene before)
    : now_(now), before_(std::move(before)), before_of_(now.instances.size(), kNone) {
    std::map<Key, std::size_t> places;
    for_each_key(before_, [&](const Key& key, std::size_t i) { places[key] = i; });
    // Change of a pair of meshes, cached because many instances may share it.
    struct Change {
        bool same_triangles, same_positions;
    };
    std::map<std::pair<const Mesh*, const Mesh*>, Change> changes;
    const auto change = [&](const Mesh& mesh, const Mesh& old) {
        const auto [known, is_new] = changes.try_emplace({&mesh, &old});
        if (is_new)
            known->second = {mesh.triangles == old.triangles && mesh.positions.size() == old.positions.size(),
                             mesh.positions == old.positions};
        return known->second;
    };
    for_each_key(now_, [&](const Key& key, std::size_t i) {
        const auto found = places.find(key);
        if (found == places.end()) return;
        const Instance &here = now_.instances[i], &there = before_.instances[found->second];
        const Change c = change(mesh_of(now_, here), mesh_of(before_, there));
        const bool still = here.object_to_world == there.object_to_world && c.same_positions;
        if (c.same_triangles && !still) before_of_[i] = static_cast<int>(found->second);
    });
}

dvec3 PreviousSurfaces::before(std::uint32_t instance, std::uint32_t triangle, const dvec3& now) const {
    const Instance& here = now_.instances[instance];
    const Instance& there = before_.instances[static_cast<std::size_t>(before_of_[instance])];
    const Mesh &mesh = mesh_of(now_, here), &old = mesh_of(before_, there);
    const uvec3 corners = mesh.triangles[triangle];
    const auto corner = [](const Mesh& m, const Instance& i, std::uint32_t vertex) {
        return dvec3(i.object_to_world * dvec4(dvec3(m.positions[vertex]), 1));
    };
    const dvec3 a = corner(mesh, here, corners.x);
    const dvec3 ab = corner(mesh, here, corners.y) - a, ac = corner(mesh, here, corners.z) - a;
    // Barycentrics are ratios of areas, because rounding may have moved the point off the plane.
    const dvec3 normal = glm::cross(ab, ac);
    const double area = glm::dot(normal, normal);
    const double v = glm::dot(glm::cross(now - a, ac), normal) / area;
    const double w = glm::dot(glm::cross(ab, now - a), normal) / area;
    const dvec3 old_a = corner(old, there, corners.x);
    return old_a + v * (corner(old, there, corners.y) - old_a) + w * (corner(old, there, corners.z) - old_a);
}

}  // namespace halflight
