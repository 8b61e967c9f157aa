// The choice of a camera and of the picture size, and the matrix that describes a camera in files.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "api/halflight/camera_pose.h"
#include "engine/scene/scene.h"

namespace halflight {

namespace rays {
class LazyProbe;
}

/// Selects a camera. The first member that is set decides, in this order: look_from, pose, camera. If none is set,
/// the scene's first camera is taken; a scene without cameras gets default_camera().
struct CameraChoice {
    // Camera of the scene: its name, or its number from 0. "inside" and "outside" are default cameras if no camera has
    // that name.
    std::optional<std::string> camera{};
    std::optional<dvec3> look_from{};      // position, world, metres; needs look_at
    std::optional<dvec3> look_at{};        // target, world, metres
    dvec3 up{0, 1, 0};                     // up direction of look_from
    double vertical_fov = 45;              // field of view of look_from, degrees, (0, 180)
    std::optional<double> override_fov{};  // field of view in place of that of `pose` and `camera`, degrees, (0, 180)
    std::optional<CameraPose> pose{};      // camera of a settings file or of the caller
    double aspect = 0;  // width / height of one eye's picture, for the camera of a scene that has none; 0: 16 / 9
    // Replaces the scene's first camera by the default one if it sees no surface; `camera` is empty then.
    bool replace_blind = false;
    bool warn_of_blind = false;  // keeps that camera, with a warning
    int turntable = 0;     // frames in which the camera turns once about the scene's centre, or about look_at; 0: none
    std::string source{};  // settings file that names `camera`, for errors; empty: none
};

/// The chosen camera and its source.
struct ChosenCamera {
    Camera camera;
    std::optional<std::size_t> index;  // number of the scene's camera; none: not a camera of the scene
    std::string origin;                // phrase after "camera": "'nave' of the scene", "of the command line", ...
    std::string options{};             // "--look-from=... --look-at=... --vfov=...": of a default camera
    std::string warning{};             // the scene's camera that sees nothing; empty: none
    Lens keyed_lens{};                 // members that edits over frames set: they replace those of settings
    dvec3 pivot{0};                    // point about which a turntable turns the camera, world units
};

/// Returns the options of the command line that give a camera which looks at a point at the depth of `at`.
std::string camera_options(const Camera& camera, const dvec3& at);

/// Returns the camera of `choice`. Throws Error that lists the scene's cameras if there is none of that name.
/// `probe` is a probe of the scene, which other questions share; null: there is none yet.
ChosenCamera choose_camera(const Scene& scene, const CameraChoice& choice, const rays::LazyProbe* probe = nullptr);

/// Returns the number of the scene's camera that has the name or number. Throws Error that lists the cameras, about
/// `source` and the scene, if there is none.
std::size_t find_camera(const Scene& scene, const std::string& wanted, const std::string& source);

/// Returns the camera of `choice` if it is none of the scene's.
std::optional<Camera> free_camera(const Scene& scene, const CameraChoice& choice);

/// Returns the azimuth of the neutral light for a choice of camera: that of its point of view, degrees from +Z to +X.
double azimuth_of_light(const Scene& scene, const CameraChoice& choice);

/// Returns a lens with the members that are set in `wanted`, and those of `lens` elsewhere.
Lens merged(Lens lens, const Lens& wanted);
/// Returns a camera whose lens follows `wanted`; members that are not set there remain those of the camera. Throws
/// Error if a focus lacks an aperture, or an aperture lacks a focus.
Camera with_lens(Camera camera, const Lens& wanted);

/// Returns optics whose values without effect are the defaults, such as the distance between eyes without stereo.
Optics effective(Optics optics);
/// Returns a camera with another projection and eyes (effective()), and with the aspect ratio of that picture. Throws
/// Error if the camera cannot have them.
Camera with_optics(Camera camera, const Optics& wanted);

/// Returns the size of a picture in pixels. A missing side follows from the camera's aspect ratio (16:9 if it has
/// none), in whole pixels of each eye; `default_width` applies if both are missing. Each side is within
/// [1, kMaxSide].
ivec2 picture_size(std::optional<int> width, std::optional<int> height, int default_width, const Camera& camera);

/// Returns the matrix from world to OpenGL's standard clip space, for files. The rasterizer uses another one, with
/// reversed depth (renderer/frame_constants.h). aspect: width / height.
dmat4 standard_clip(const Camera& camera, double aspect);

}  // namespace halflight
