// Camera pose for navigation and settings files.
#pragma once

#include <string>

#include "engine/scene/scene.h"

namespace halflight {

/// The few numbers that define a view; equal numbers give an equal Camera, bit for bit.
struct CameraPose {
    dvec3 from{0, 0, 1};            // world units
    dvec3 at{0};                    // world units; point to look at and to orbit around, not `from`
    dvec3 up{0, 1, 0};              // not parallel to the line of sight; any length but 0
    double vertical_fov = kPi / 4;  // radians, (0, pi)
    bool orthographic = false;
    double ortho_height = 2;  // world units, > 0
    double near_plane = 0;    // near and far plane of Camera
    double far_plane = 0;
    bool operator==(const CameraPose&) const = default;
};

struct Bookmark {
    std::string name;
    CameraPose pose;
    bool operator==(const Bookmark&) const = default;
};

/// Returns the camera. Throws Error where the numbers define no view.
Camera camera_of(const CameraPose& pose);

/// Returns the pose of a camera that looks at the point `distance` > 0 ahead. Its up is +Y unless the camera rolls or
/// looks along +Y.
CameraPose pose_of(const Camera& camera, double distance);

}  // namespace halflight
