#include "api/halflight/camera_pose.h"

#include <cmath>

#include "engine/core/error.h"

namespace halflight {

Camera camera_of(const CameraPose& pose) {
    Camera camera = look_at_camera(pose.from, pose.at, pose.up, pose.vertical_fov);
    if (pose.orthographic && !(pose.ortho_height > 0 && std::isfinite(pose.ortho_height)))
        throw Error("camera", "height of the view must be positive");
    if (pose.far_plane != 0 && pose.far_plane <= pose.near_plane) throw Error("camera", "far must be beyond near");
    camera.orthographic = pose.orthographic;
    camera.ortho_height = pose.ortho_height;
    camera.near_plane = pose.near_plane;
    camera.far_plane = pose.far_plane;
    return camera;
}

double exact_degrees(double radians) {
    const double near = glm::degrees(radians);
    for (const double to : {0.0, 360.0}) {
        double candidate = near;
        for (int i = 0; i < 3; ++i) {
            if (glm::radians(candidate) == radians) return candidate;
            candidate = std::nextafter(candidate, to);
        }
    }
    return near;
}

CameraPose pose_of(const Camera& camera, double distance) {
    constexpr double kRoll = 1e-6;             // sine of the largest roll that counts as none
    constexpr double kAlmostVertical = 0.999;  // |y| of the line of sight's unit vector
    const dvec3 right(camera.camera_to_world[0]), up(camera.camera_to_world[1]), back(camera.camera_to_world[2]);
    CameraPose pose;
    pose.from = dvec3(camera.camera_to_world[3]);
    pose.at = pose.from - distance * back;
    const bool upright = std::abs(right.y) < kRoll && up.y > 0 && std::abs(back.y) < kAlmostVertical;
    pose.up = upright ? dvec3(0, 1, 0) : up;
    pose.vertical_fov = glm::radians(exact_degrees(camera.vertical_fov));
    pose.orthographic = camera.orthographic;
    pose.ortho_height = camera.ortho_height;
    pose.near_plane = camera.near_plane;
    pose.far_plane = camera.far_plane;
    return pose;
}

}  // namespace halflight
