// The camera of scenes that have none.
#pragma once

#include "engine/rays/scene_probe.h"
#include "engine/scene/scene.h"

namespace halflight {

inline constexpr const char* kInsideCamera = "inside";  ///< name of a default camera inside a scene

struct DefaultCamera {
    Camera camera;
    bool inside = false;  // it stands inside a closed scene
};

inline constexpr double kUsualAspect = 16.0 / 9;  ///< width / height of a picture whose size is not known

/// Returns framing_camera(), or a camera inside where the scene is a closed interior. `aspect` is the picture's width /
/// height. With `turns`, the scene stays in the picture while the camera turns about it.
///
/// A scene is a closed interior if most points within its bounds are enclosed: nearly all rays from them meet surfaces,
/// most of them front faces. Solid objects show their back faces there. The camera inside has a vertical field of view
/// of 60 degrees and looks horizontally. Among fixed candidates it has the longest view of the most objects. Scenes in
/// pages are always seen from outside.
DefaultCamera default_camera(const Scene& scene, double aspect, bool turns = false);
/// Returns the same camera; the scene's probe is given.
DefaultCamera default_camera(const Scene& scene, double aspect, const rays::SceneProbe& probe, bool turns = false);

/// Returns a camera turned about the vertical axis through a point; positive angles (radians) turn it to the right as
/// it looks at that point.
Camera turned(const Camera& camera, const dvec3& pivot, double angle);

}  // namespace halflight
