// Cameras as a few numbers that users steer and settings files store.
#pragma once

#include <string>

#include "engine/scene/scene.h"

namespace halflight {

/// Defines a view by a few numbers. Equal numbers make equal Cameras, bit for bit.
struct CameraPose {
    dvec3 from{0, 0, 1};            // position, world units
    dvec3 at{0};                    // target and centre of orbits, world units; differs from `from`
    dvec3 up{0, 1, 0};              // up direction, any length but 0, not parallel to the line of sight
    double vertical_fov = kPi / 4;  // field of view, radians, (0, pi)
    bool orthographic = false;
    double ortho_height = 2;  // height of the view, world units, > 0
    double near_plane = 0;    // distance, world units; 0: chosen from the scene
    double far_plane = 0;     // distance, world units; 0: infinite
    bool operator==(const CameraPose&) const = default;
};

/// A camera pose that is saved under a name.
struct Bookmark {
    std::string name;
    CameraPose pose;
    bool operator==(const Bookmark&) const = default;
};

/// Returns the camera of a pose. Throws Error if the numbers define no view.
Camera camera_of(const CameraPose& pose);

/// Returns the degrees from which glm::radians() gives the angle, as far as there are such; else the nearest ones.
double exact_degrees(double radians);

/// Returns the pose of a camera; its target lies `distance` > 0 ahead. Up is +Y unless the camera rolls or looks along
/// +-Y. The field of view is rounded to one that exact_degrees() has, so that settings files give it back.
CameraPose pose_of(const Camera& camera, double distance);

}  // namespace halflight
