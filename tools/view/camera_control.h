// How drags, keys and clicks move a camera: pure functions of its pose.
#pragma once

#include "tools/halflight/camera_pose.h"

namespace halflight::view {

/// Turns around `at`, as if the scene followed a drag to the right (x) and down (y); radians. Stops short of looking
/// along `up`.
CameraPose orbit(CameraPose pose, const dvec2& angle);
/// Moves camera and `at` sideways, as if the scene followed a drag to the right and down; in heights of the view at the
/// distance of `at`.
CameraPose pan(CameraPose pose, const dvec2& heights);
/// Distance to `at` (orthographic: height of the view) times `factor` > 0. Comes no nearer than roundings allow in a
/// scene of this diagonal, world units.
CameraPose dolly(CameraPose pose, double factor, double diagonal);
/// Turns the head to the right (x) and down (y), radians; stops short of looking along `up`.
CameraPose turn(CameraPose pose, const dvec2& angle);
/// Moves to the right (x), along `up` (y) and ahead (z), world units.
CameraPose fly(CameraPose pose, const dvec3& step);
/// Moves to the right (x), up (y) and ahead (z), world units, all but y on the level: +Y is up, wherever the camera's
/// is.
CameraPose walk(CameraPose pose, const dvec3& step);
/// Looks at a point from where it is. A point at the camera changes nothing.
CameraPose look_at(CameraPose pose, const dvec3& point);
/// Looks at the box's centre from the same direction, far enough to see the whole of it in a picture of this aspect
/// (width / height). An empty box changes nothing.
CameraPose frame(CameraPose pose, const WorldBounds& box, double aspect);

struct Ray {
    dvec3 origin;     // world
    dvec3 direction;  // unit
};
/// Through a point of the picture, pixels from its upper left corner.
Ray ray_through(const Camera& camera, const dvec2& point, const ivec2& size);

}  // namespace halflight::view
