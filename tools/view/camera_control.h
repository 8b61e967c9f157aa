// Camera movements by drags, keys and clicks, as pure functions of the camera pose.
#pragma once

#include <limits>

#include "api/halflight/camera_pose.h"

namespace halflight::view {

/// Orbits around `at`; the scene follows a drag to the right (x) and down (y), radians. Stops before the line of sight
/// is parallel to `up`.
CameraPose orbit(CameraPose pose, const dvec2& angle);
/// Moves the camera and `at` sideways; the scene follows a drag to the right and down. The unit is the height of the
/// view at the distance of `at`.
CameraPose pan(CameraPose pose, const dvec2& heights);
/// Scales the distance to `at`, or the view's height of an orthographic camera, by `factor` > 0. The minimum distance
/// is given by float precision in a scene with this diagonal, world units.
CameraPose dolly(CameraPose pose, double factor, double diagonal);
/// Rotates the camera to the right (x) and down (y), radians. Stops before the line of sight is parallel to `up`.
CameraPose turn(CameraPose pose, const dvec2& angle);
/// Moves to the right (x), along `up` (y) and ahead (z), world units.
CameraPose fly(CameraPose pose, const dvec3& step);
/// Moves to the right (x), up (y) and ahead (z), world units. x and z are horizontal: +Y is up, whatever the camera's
/// `up` is.
CameraPose walk(CameraPose pose, const dvec3& step);
/// Aims the camera at a point without moving it. A point at the camera changes nothing.
CameraPose look_at(CameraPose pose, const dvec3& point);
/// Aims at the centre of the box from the same direction. The distance is such that a picture of this aspect (width /
/// height) shows the whole box. An empty box changes nothing.
CameraPose frame(CameraPose pose, const WorldBounds& box, double aspect);

/// Looks at the same point from a direction, at the same distance.
CameraPose seen_from(CameraPose pose, const dvec3& direction);

struct Ray {
    dvec3 origin;      // position, world units
    dvec3 direction;   // unit vector, world space
    double begin = 0;  // distances between which surfaces are seen, world units
    double end = std::numeric_limits<double>::infinity();
};
/// Returns the ray through a point of the picture, pixels from its upper left corner, between the camera's planes.
Ray ray_through(const Camera& camera, const dvec2& point, const ivec2& size);

}  // namespace halflight::view
