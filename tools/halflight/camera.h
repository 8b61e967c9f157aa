// Which camera, which size of picture, and the matrices that describe them.
#pragma once

#include "engine/scene/scene.h"
#include "tools/halflight/arguments.h"

namespace halflight {

struct ChosenCamera {
    Camera camera;
    std::optional<std::size_t> index;  // of the scene's cameras, where it is one of them
    std::string origin;                // after "camera": "'nave' of the scene", "of the command line", ...
};

/// Throws Error that lists the scene's cameras where the one asked for is not among them.
ChosenCamera choose_camera(const Scene& scene, const ViewArguments& arguments);

/// Pixels; what is not given follows from the camera's shape (16:9 if it has none) and the usual width.
ivec2 picture_size(const ViewArguments& arguments, const Camera& camera);

/// World to OpenGL's usual clip space, for files; the rasterizer has its own, with reversed depth
/// (renderer/frame_constants.h). aspect: width / height.
dmat4 standard_clip(const Camera& camera, double aspect);

}  // namespace halflight
