#include "tools/view/pick.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace halflight::view {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();

/// Returns whether the ray meets the box before `t` (slab test).
bool meets(const Bounds& box, const dvec3& origin, const dvec3& direction, double t) {
    if (box.empty()) return false;
    double near = 0, far = t;
    for (int axis = 0; axis < 3; ++axis) {
        if (direction[axis] == 0) {
            if (origin[axis] < double{box.lower[axis]} || origin[axis] > double{box.upper[axis]}) return false;
            continue;
        }
        double a = (double{box.lower[axis]} - origin[axis]) / direction[axis];
        double b = (double{box.upper[axis]} - origin[axis]) / direction[axis];
        if (a > b) std::swap(a, b);
        near = std::max(near, a);
        far = std::min(far, b);
    }
    return near <= far;
}

/// Returns the distance along the ray, or kFar if it misses or meets the triangle before `begin` (Moeller, Trumbore
/// 1997). front: meets the front only.
double distance(const dvec3& origin, const dvec3& direction, double begin, const dvec3& a, const dvec3& b,
                const dvec3& c, bool front) {
    const dvec3 u = b - a, v = c - a, p = glm::cross(direction, v);
    const double det = glm::dot(u, p);
    if (det == 0 || (front && det < 0)) return kFar;
    const dvec3 s = origin - a, q = glm::cross(s, u);
    const double x = glm::dot(s, p) / det, y = glm::dot(direction, q) / det, t = glm::dot(v, q) / det;
    return x >= 0 && y >= 0 && x + y <= 1 && t > 0 && t >= begin ? t : kFar;
}

}  // namespace

WorldBounds united(const WorldBounds& a, const WorldBounds& b) {
    return {glm::min(a.lower, b.lower), glm::max(a.upper, b.upper)};
}

Picker::Picker(std::shared_ptr<const Scene> scene) : scene_(std::move(scene)), instances_(scene_->instances) {
    for (const Mesh& mesh : scene_->meshes) {
        Bounds& box = boxes_.emplace_back();
        for (const vec3& p : mesh.positions) box.add(p);
    }
}

Picker Picker::with_instances(std::vector<Instance> instances) const {
    Picker other = *this;
    other.instances_ = std::move(instances);
    return other;
}

std::optional<PickResult> Picker::pick(const Ray& ray, const std::vector<bool>& one_sided) const {
    double nearest = ray.end;
    std::optional<std::size_t> instance;
    for (std::size_t i = 0; i < instances_.size(); ++i) {
        const Instance& in = instances_[i];
        const Mesh& mesh = scene_->meshes[static_cast<std::size_t>(in.mesh)];
        // The direction is not normalized, so distances stay world distances.
        const dmat4 to_object = glm::inverse(in.object_to_world);
        const dvec3 origin(to_object * dvec4(ray.origin, 1)), direction(to_object * dvec4(ray.direction, 0));
        if (!meets(boxes_[static_cast<std::size_t>(in.mesh)], origin, direction, nearest)) continue;
        for (std::size_t j = 0; j < mesh.triangles.size(); ++j) {
            const uvec3& t = mesh.triangles[j];
            const std::uint32_t material = mesh.triangle_material[j];
            const double found =
                distance(origin, direction, ray.begin, dvec3(mesh.positions[t.x]), dvec3(mesh.positions[t.y]),
                         dvec3(mesh.positions[t.z]), material < one_sided.size() && one_sided[material]);
            if (found < nearest) nearest = found, instance = i;
        }
    }
    if (!instance) return std::nullopt;
    return PickResult{ray.origin + nearest * ray.direction, *instance};
}

WorldBounds Picker::bounds(std::size_t instance) const {
    const Instance& in = instances_[instance];
    const Bounds& box = boxes_[static_cast<std::size_t>(in.mesh)];
    WorldBounds world;
    for (int corner = 0; corner < 8 && !box.empty(); ++corner) {
        const dvec3 p(corner & 1 ? box.upper.x : box.lower.x, corner & 2 ? box.upper.y : box.lower.y,
                      corner & 4 ? box.upper.z : box.lower.z);
        const dvec3 at(in.object_to_world * dvec4(p, 1));
        world.lower = glm::min(world.lower, at);
        world.upper = glm::max(world.upper, at);
    }
    return world;
}

double distance_ahead(const Camera& camera, const Picker& picker, const Scene& scene) {
    const Ray ray = ray_through(camera, {0.5, 0.5}, {1, 1});
    if (const auto picked = picker.pick(ray)) return glm::length(picked->position - ray.origin);
    const WorldBounds box = world_bounds(scene);
    if (box.empty()) return 1;
    const double ahead = glm::dot(0.5 * box.lower + 0.5 * box.upper - ray.origin, ray.direction);
    return ahead > 0 ? ahead : std::max(glm::length(box.upper - box.lower), 1e-6);
}

double orbit_distance(const Camera& camera, const Picker& picker, const Scene& scene) {
    constexpr double kFree = 0.9;    // share of the free distance that an orbit may use
    constexpr double kLeast = 0.05;  // least distance, share of the distance to the surface ahead
    const double ahead = distance_ahead(camera, picker, scene);
    if (camera.orthographic) return ahead;
    double distance = ahead;
    const dmat4& m = camera.camera_to_world;
    // The directions lead to the left and to the right, and diagonally backwards.
    for (const double side : {-1.0, 1.0})
        for (const double back : {0.0, 1.0}) {
            const dvec3 direction = glm::normalize(side * dvec3(m[0]) + back * dvec3(m[2]));
            if (const auto picked = picker.pick({dvec3(m[3]), direction}))
                distance = std::min(distance, kFree * glm::length(picked->position - dvec3(m[3])));
        }
    return std::max(distance, kLeast * ahead);
}

}  // namespace halflight::view
