#include "tools/view/camera_control.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

namespace halflight::view {
namespace {

constexpr double kPole = 1e-3;   // radians, minimum angle between line of sight and `up`
constexpr double kLeast = 1e-9;  // minimum dolly distance, relative to the larger of coordinates and scene

dvec3 rotated(const dvec3& v, double angle, const dvec3& axis) {
    return dvec3(glm::rotate(dmat4(1), angle, axis) * dvec4(v, 0));
}

/// Rotates v about `up` to the left by x, then towards `up` by y as far as kPole allows.
dvec3 turned(const dvec3& v, const dvec3& up, const dvec2& angle) {
    const dvec3 around = rotated(v, angle.x, up);
    const double polar = std::acos(std::clamp(glm::dot(glm::normalize(around), up), -1.0, 1.0));
    const double wanted = std::clamp(polar - angle.y, kPole, kPi - kPole);
    return rotated(around, wanted - polar, glm::normalize(glm::cross(up, around)));
}

struct Axes {
    dvec3 right, up, ahead;
};
Axes axes_of(const CameraPose& pose) {
    const dmat4 m = camera_of(pose).camera_to_world;
    return {dvec3(m[0]), dvec3(m[1]), -dvec3(m[2])};
}

}  // namespace

CameraPose orbit(CameraPose pose, const dvec2& angle) {
    pose.from = pose.at + turned(pose.from - pose.at, glm::normalize(pose.up), {-angle.x, angle.y});
    return pose;
}

CameraPose pan(CameraPose pose, const dvec2& heights) {
    const Axes axes = axes_of(pose);
    const double height =
        pose.orthographic ? pose.ortho_height : 2 * glm::length(pose.at - pose.from) * std::tan(pose.vertical_fov / 2);
    const dvec3 step = height * (heights.y * axes.up - heights.x * axes.right);
    pose.from += step;
    pose.at += step;
    return pose;
}

CameraPose dolly(CameraPose pose, double factor, double diagonal) {
    const double distance = pose.orthographic ? pose.ortho_height : glm::length(pose.from - pose.at);
    const double least = kLeast * std::max(glm::length(pose.at), diagonal);
    factor = std::max(factor, std::min(least / distance, 1.0));  // a camera that is closer already stays where it is
    if (pose.orthographic)
        pose.ortho_height *= factor;
    else
        pose.from = pose.at + factor * (pose.from - pose.at);
    return pose;
}

CameraPose turn(CameraPose pose, const dvec2& angle) {
    pose.at = pose.from + turned(pose.at - pose.from, glm::normalize(pose.up), {-angle.x, -angle.y});
    return pose;
}

CameraPose fly(CameraPose pose, const dvec3& step) {
    const Axes axes = axes_of(pose);
    const dvec3 move = step.x * axes.right + step.y * glm::normalize(pose.up) + step.z * axes.ahead;
    pose.from += move;
    pose.at += move;
    return pose;
}

CameraPose walk(CameraPose pose, const dvec3& step) {
    const dvec3 up(0, 1, 0), side = axes_of(pose).right - axes_of(pose).right.y * up;
    if (glm::length(side) < kPole) return fly(pose, step);  // the camera is rolled by 90 degrees
    const dvec3 right = glm::normalize(side);
    const dvec3 move = step.x * right + step.y * up + step.z * glm::cross(up, right);
    pose.from += move;
    pose.at += move;
    return pose;
}

CameraPose look_at(CameraPose pose, const dvec3& point) {
    const dvec3 sight = point - pose.from;
    if (glm::length(sight) == 0) return pose;
    pose.at = point;
    const dvec3 up = glm::normalize(pose.up);
    const double sine = glm::length(glm::cross(glm::normalize(sight), up));
    if (sine < kPole) {
        // The line of sight is vertical, so the camera moves aside by as little as kPole allows.
        const dvec3 aside = glm::normalize(glm::cross(up, std::abs(up.x) < 0.9 ? dvec3(1, 0, 0) : dvec3(0, 1, 0)));
        pose.from = point - rotated(sight, 2 * kPole, aside);
    }
    return pose;
}

CameraPose frame(CameraPose pose, const WorldBounds& box, double aspect) {
    if (box.empty()) return pose;
    const dvec3 centre = 0.5 * box.lower + 0.5 * box.upper;
    double radius = 0.5 * glm::length(box.upper - box.lower);
    if (radius == 0) radius = 1;
    const dvec3 back = glm::normalize(pose.from - pose.at);
    // The narrower side of the view decides the distance.
    const double slope = std::tan(pose.vertical_fov / 2) * std::min(aspect, 1.0);
    const double distance = pose.orthographic ? 2 * radius : radius / std::sin(std::atan(slope));
    if (pose.orthographic) pose.ortho_height = 2 * radius / std::min(aspect, 1.0);
    pose.at = centre;
    pose.from = centre + distance * back;
    return pose;
}

CameraPose seen_from(CameraPose pose, const dvec3& direction) {
    pose.from = pose.at + glm::length(pose.from - pose.at) * glm::normalize(direction);
    return look_at(pose, pose.at);
}

Ray ray_through(const Camera& camera, const dvec2& point, const ivec2& size) {
    const dmat4& m = camera.camera_to_world;
    const double half = camera.orthographic ? camera.ortho_height / 2 : std::tan(camera.vertical_fov / 2);
    const dvec2 plane((2 * point.x - size.x) / size.y * half, (1 - 2 * point.y / size.y) * half);
    const dvec3 origin(m[3]), aside = plane.x * dvec3(m[0]) + plane.y * dvec3(m[1]);
    Ray ray{origin, glm::normalize(aside - dvec3(m[2]))};
    if (camera.orthographic) ray = {origin + aside, -dvec3(m[2])};
    const double along = -glm::dot(ray.direction, dvec3(m[2]));  // planes have their distances along the axis
    ray.begin = camera.near_plane / along;
    if (camera.far_plane > 0) ray.end = camera.far_plane / along;
    return ray;
}

}  // namespace halflight::view
