#include "api/default_camera.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <random>
#include <set>
#include <vector>

#include "engine/rays/scene_probe.h"

namespace halflight {
namespace {

constexpr int kPoints = 192;     // points within the bounds
constexpr int kDirections = 48;  // rays from each point

/// Returns directions that are spread evenly over the sphere (spherical Fibonacci points).
std::vector<dvec3> directions() {
    std::vector<dvec3> all;
    for (int i = 0; i < kDirections; ++i) {
        const double y = 1 - (2 * i + 1.0) / kDirections, r = std::sqrt(1 - y * y),
                     phi = i * kPi * (3 - std::sqrt(5.0));
        all.emplace_back(r * std::cos(phi), y, r * std::sin(phi));
    }
    return all;
}

/// Returns the enclosed points within the bounds, at the middle of their height.
std::vector<dvec3> enclosed_points(const rays::SceneProbe& probe) {
    constexpr double kHits = 0.88;   // least share of rays that meet a surface; a box without one side has 0.83
    constexpr double kFront = 0.75;  // least share of hits that are front faces
    const std::vector<dvec3> around = directions();
    const dvec3 lower = probe.bounds().lower, size = probe.bounds().upper - lower;
    std::mt19937_64 random(1);
    const auto uniform = [&] { return double(random() >> 11) * 0x1p-53; };
    std::vector<dvec3> enclosed;
    for (int i = 0; i < kPoints; ++i) {
        const double x = uniform(), y = 0.4 + 0.2 * uniform(), z = uniform();
        const dvec3 point = lower + size * dvec3(x, y, z);
        int hits = 0, front = 0;
        for (const dvec3& direction : around)
            if (const auto hit = probe.trace(point, direction)) ++hits, front += hit->front;
        if (hits >= kHits * kDirections && front >= kFront * hits) enclosed.push_back(point);
    }
    return enclosed;
}

/// Returns how much a view shows; negative where something is too close.
double value_of(const rays::SceneProbe& probe, const Camera& camera, double aspect) {
    constexpr int kColumns = 9, kRows = 5;
    const double half = std::tan(camera.vertical_fov / 2),
                 size = glm::length(probe.bounds().upper - probe.bounds().lower);
    const dmat4& m = camera.camera_to_world;
    std::set<std::size_t> instances;
    double logs = 0, nearest = size;
    for (int i = 0; i < kColumns * kRows; ++i) {
        const double x = (2 * (i % kColumns) + 1.0) / kColumns - 1, y = (2 * (i / kColumns) + 1.0) / kRows - 1;
        const dvec3 direction = glm::normalize(x * half * aspect * dvec3(m[0]) + y * half * dvec3(m[1]) - dvec3(m[2]));
        const auto hit = probe.trace(dvec3(m[3]), direction);
        const double distance = hit ? glm::length(hit->position - dvec3(m[3])) : size;
        if (hit) instances.insert(hit->instance);
        nearest = std::min(nearest, distance);
        logs += std::log2(std::max(distance / size, 1e-3)) / (kColumns * kRows);
    }
    constexpr double kClose = 0.04;  // least distance over the scene's diagonal
    return nearest < kClose * size ? -1 : 10 + logs + 0.5 * std::log2(1.0 + double(instances.size()));
}

}  // namespace

Camera turned(const Camera& camera, const dvec3& pivot, double angle) {
    Camera turned = camera;
    const dmat4 rotation = glm::rotate(dmat4(1), angle, dvec3(0, 1, 0));
    dmat4 m = rotation * camera.camera_to_world;
    m[3] = dvec4(pivot + dmat3(rotation) * (dvec3(camera.camera_to_world[3]) - pivot), 1);
    turned.camera_to_world = m;
    return turned;
}

DefaultCamera default_camera(const Scene& scene, double aspect, bool turns) {
    if (scene.paged_bounds || world_bounds(scene).empty()) return {framing_camera(scene, aspect, turns)};
    return default_camera(scene, aspect, rays::SceneProbe(scene), turns);
}

DefaultCamera default_camera(const Scene& scene, double aspect, const rays::SceneProbe& probe, bool turns) {
    constexpr double kEnclosed = 0.6;  // least share of points that are enclosed
    constexpr int kYaws = 12;
    constexpr std::size_t kCandidates = 48;
    const DefaultCamera outside{framing_camera(scene, aspect, turns)};
    if (scene.paged_bounds || world_bounds(scene).empty()) return outside;
    const std::vector<dvec3> points = enclosed_points(probe);
    if (double(points.size()) < kEnclosed * kPoints) return outside;
    DefaultCamera best = outside;
    double most = 0;
    for (std::size_t i = 0; i < std::min(points.size(), kCandidates); ++i)
        for (int yaw = 0; yaw < kYaws; ++yaw) {
            const double angle = 2 * kPi * yaw / kYaws;
            const dvec3 ahead(std::sin(angle), 0, std::cos(angle));
            const Camera camera =
                look_at_camera(points[i], points[i] + ahead * glm::length(probe.bounds().upper - probe.bounds().lower),
                               {0, 1, 0}, kPi / 3);
            if (const double value = value_of(probe, camera, aspect); value > most) {
                most = value;
                best = {camera, true};
                best.camera.name = kInsideCamera;
            }
        }
    return best;
}

}  // namespace halflight
