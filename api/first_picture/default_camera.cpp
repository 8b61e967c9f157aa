#include "api/first_picture/default_camera.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <map>
#include <random>
#include <tuple>
#include <vector>

#include "engine/scene/framing.h"

namespace halflight {
namespace {

/// Returns the box between two quantiles of the vertices' coordinates, q and 1 - q, by axis.
WorldBounds trimmed_bounds(const Scene& scene, double q) {
    constexpr std::size_t kMost = std::size_t{1} << 16;  // vertices that are asked
    std::size_t vertices = 0;
    const auto mesh_of = [&](const Instance& i) -> const Mesh& {
        return scene.meshes[static_cast<std::size_t>(i.mesh)];
    };
    for (const Instance& instance : scene.instances) vertices += mesh_of(instance).positions.size();
    const std::size_t step = vertices / kMost + 1;
    std::array<std::vector<double>, 3> coordinates;
    std::size_t next = 0;  // place of the next vertex within the instance
    for (const Instance& instance : scene.instances) {
        const std::vector<vec3>& positions = mesh_of(instance).positions;
        for (; next < positions.size(); next += step) {
            const dvec3 p(instance.object_to_world * dvec4(positions[next], 1));
            for (int axis = 0; axis < 3; ++axis) coordinates[static_cast<std::size_t>(axis)].push_back(p[axis]);
        }
        next -= positions.size();
    }
    WorldBounds bounds;
    for (int axis = 0; axis < 3; ++axis) {
        std::vector<double>& values = coordinates[static_cast<std::size_t>(axis)];
        if (values.empty()) return {};
        const auto rank = static_cast<std::ptrdiff_t>(q * double(values.size()));
        std::ranges::nth_element(values, values.begin() + rank);
        bounds.lower[axis] = values[static_cast<std::size_t>(rank)];
        std::ranges::nth_element(values, values.end() - 1 - rank);
        bounds.upper[axis] = *(values.end() - 1 - rank);
    }
    return bounds;
}

}  // namespace

std::vector<dvec3> sphere_directions(int count) {
    std::vector<dvec3> all;
    for (int i = 0; i < count; ++i) {
        const double y = 1 - (2 * i + 1.0) / count, r = std::sqrt(1 - y * y), phi = i * kPi * (3 - std::sqrt(5.0));
        all.emplace_back(r * std::cos(phi), y, r * std::sin(phi));
    }
    return all;
}

std::pair<dvec3, dvec3> camera_ray(const Camera& camera, double aspect, double x, double y) {
    const dmat4& m = camera.camera_to_world;
    const double half = camera.orthographic ? camera.ortho_height / 2 : std::tan(camera.vertical_fov / 2);
    const dvec3 aside = (2 * x - 1) * half * aspect * dvec3(m[0]) + (1 - 2 * y) * half * dvec3(m[1]);
    if (camera.orthographic) return {dvec3(m[3]) + aside, -dvec3(m[2])};
    return {dvec3(m[3]), glm::normalize(aside - dvec3(m[2]))};
}

Glimpse glimpse(const rays::SceneProbe& probe, const Camera& camera, double aspect, int columns) {
    const int rows = columns * 9 / 16;
    using Class = std::tuple<std::size_t, const Material*, int, int>;
    std::map<Class, int> classes;
    Glimpse g{.nearest = rays::SceneProbe::kFar};
    for (int i = 0; i < columns * rows; ++i) {
        const auto [origin, direction] =
            camera_ray(camera, aspect, (i % columns + 0.5) / columns, (i / columns + 0.5) / rows);
        const auto hit = probe.see(origin, direction);
        if (!hit) continue;
        const double distance = glm::length(hit->position - origin);
        g.nearest = std::min(g.nearest, distance);
        const dvec3 n = glm::abs(hit->normal);
        const int axis = n.x > std::max(n.y, n.z) ? 0
                         : n.y > n.z              ? 1
                                                  : 2,
                  side = hit->normal[axis] < 0 ? axis : axis + 3;
        ++classes[{hit->instance, hit->material, side, std::ilogb(distance)}];
    }
    for (const auto& [what, count] : classes) {
        const double share = double(count) / (columns * rows);
        g.seen += share;
        g.detail -= share * std::log2(share);
    }
    return g;
}

std::vector<dvec3> enclosed_places(const rays::SceneProbe& probe, int points) {
    constexpr double kHits = 0.88;   // least share of rays that meet a surface; a box without one side has 0.83
    constexpr double kFront = 0.75;  // least share of hits that are front faces
    const std::vector<dvec3> around = sphere_directions(48);
    const dvec3 lower = probe.bounds().lower, size = probe.bounds().upper - lower;
    std::mt19937_64 random(1);
    const auto uniform = [&] { return double(random() >> 11) * 0x1p-53; };
    std::vector<dvec3> enclosed;
    for (int i = 0; i < points; ++i) {
        const double x = uniform(), y = 0.2 + 0.4 * uniform(), z = uniform();
        const dvec3 place = lower + size * dvec3(x, y, z);
        int hits = 0, front = 0;
        for (const dvec3& direction : around)
            if (const auto hit = probe.trace(place, direction)) ++hits, front += hit->front;
        if (hits >= kHits * double(around.size()) && front >= kFront * hits) enclosed.push_back(place);
    }
    return enclosed;
}

Camera turned(const Camera& camera, const dvec3& pivot, double angle) {
    Camera turned = camera;
    const dmat4 rotation = glm::rotate(dmat4(1), angle, dvec3(0, 1, 0));
    dmat4 m = rotation * camera.camera_to_world;
    m[3] = dvec4(pivot + dmat3(rotation) * (dvec3(camera.camera_to_world[3]) - pivot), 1);
    turned.camera_to_world = m;
    return turned;
}

DefaultCamera default_camera(const rays::SceneProbe& probe, double aspect, View view, bool turns) {
    const Scene& scene = probe.scene();
    const WorldBounds& box = probe.bounds();
    DefaultCamera outside{framing_camera(scene, aspect, turns),
                          box.empty() ? dvec3(0) : 0.5 * box.lower + 0.5 * box.upper};
    if (scene.paged_bounds || probe.bounds().empty()) return outside;
    constexpr double kLittle = 1, kClearlyMore = 0.5;  // bits
    constexpr double kPart = 0.05;                     // most that a part may have of the scene's diagonal
    const double diagonal = glm::length(probe.bounds().upper - probe.bounds().lower);
    double shown = glimpse(probe, outside.camera, aspect).detail;
    for (const double share : {0.01, 0.05, 0.15}) {
        if (shown > kLittle) break;
        WorldBounds part = trimmed_bounds(scene, share);
        if (part.empty() || part.lower == part.upper || glm::length(part.upper - part.lower) > kPart * diagonal)
            continue;
        const dvec3 margin = 0.2 * (part.upper - part.lower);  // vertices that were trimmed, too
        part = {glm::max(part.lower - margin, probe.bounds().lower),
                glm::min(part.upper + margin, probe.bounds().upper)};
        const Camera camera = framing_camera(part, aspect, turns);
        const double detail = glimpse(probe, camera, aspect).detail;
        if (detail > shown + kClearlyMore)
            outside = {.camera = camera, .centre = 0.5 * part.lower + 0.5 * part.upper, .left_out = true},
            shown = detail;
    }
    if (view == View::outside) return outside;

    constexpr int kPoints = 192, kYaws = 12;
    constexpr std::size_t kCandidates = 32;
    constexpr double kClose = 0.04;  // least distance over the scene's diagonal
    std::vector<dvec3> places = enclosed_places(probe, kPoints);
    const double enclosed = double(places.size()) / kPoints;
    DefaultCamera best = outside;
    double most = -1;
    for (std::size_t i = 0; i < std::min(places.size(), kCandidates); ++i)
        for (int yaw = 0; yaw < kYaws; ++yaw) {
            const double angle = 2 * kPi * yaw / kYaws;
            const dvec3 ahead(std::sin(angle), 0, std::cos(angle));
            const dvec3& from = places[i];
            const Camera camera = look_at_camera(from, from + diagonal * ahead, {0, 1, 0}, kPi / 3);
            const Glimpse g = glimpse(probe, camera, aspect);
            if (g.detail <= most || g.nearest < kClose * diagonal) continue;
            most = g.detail;
            best = {.camera = camera, .centre = from, .inside = true};
            best.camera.name = kInsideCamera;
        }
    if (view == View::inside) return best;
    // The surroundings of an object are no loss, so the entropy of what is seen from outside leaves them out.
    const Glimpse g = glimpse(probe, outside.camera, aspect);
    const double object = g.seen > 0 ? g.detail / g.seen + std::log2(g.seen) : 0;
    constexpr double kMargin = 0.5;  // bits
    return best.inside && most + std::log2(enclosed) > object + kMargin ? best : outside;
}

}  // namespace halflight
