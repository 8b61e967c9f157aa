// A camera as people steer it and as files keep it.
#pragma once

#include <string>

#include "engine/scene/scene.h"

namespace halflight {

/// What defines a view by few numbers; the same numbers make the same Camera, bit for bit.
struct CameraPose {
    dvec3 from{0, 0, 1};            // world
    dvec3 at{0};                    // world; what it looks at and turns around, not `from`
    dvec3 up{0, 1, 0};              // not along the line of sight; any length but 0
    double vertical_fov = kPi / 4;  // radians, (0, pi)
    bool orthographic = false;
    double ortho_height = 2;  // world units, > 0
    double near_plane = 0;    // as of Camera
    double far_plane = 0;
    bool operator==(const CameraPose&) const = default;
};

struct Bookmark {
    std::string name;
    CameraPose pose;
    bool operator==(const Bookmark&) const = default;
};

/// Throws Error where the numbers define no view.
Camera camera_of(const CameraPose& pose);

/// The camera's view, looking at what is `distance` > 0 ahead; its up is +Y unless it rolls or looks along it.
CameraPose pose_of(const Camera& camera, double distance);

}  // namespace halflight
