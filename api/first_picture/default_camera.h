// The camera of scenes that have none, chosen by small pictures that rays on the CPU make.
#pragma once

#include <vector>

#include "api/halflight/camera.h"
#include "engine/rays/scene_probe.h"
#include "engine/scene/scene.h"

namespace halflight {

/// Names of default cameras; both can be asked for.
inline constexpr const char *kInsideCamera = "inside", *kOutsideCamera = "outside";
inline constexpr double kUsualAspect = 16.0 / 9;  ///< width / height of a picture whose size is not known

/// Side from which a default camera sees a scene.
enum class View { automatic, inside, outside };

struct DefaultCamera {
    Camera camera;
    dvec3 centre{0};        // centre of what the camera frames, world units; inside: the camera's position
    bool inside = false;    // the camera stands inside the scene
    bool left_out = false;  // the camera leaves out small parts far away, or most of a large ground
};

/// Contents of a small picture.
struct Glimpse {
    double seen = 0;     // share of rays that meet a surface which the camera shows, [0,1]
    double detail = 0;   // entropy of surfaces, directions of their normals and distances in octaves, bits
    double nearest = 0;  // distance to the nearest surface, world units
};
/// Returns what a picture of `columns` times 9 / 16 of as many rows shows.
Glimpse glimpse(const rays::SceneProbe& probe, const Camera& camera, double aspect, int columns = 16);

/// Returns a ray through a point of the picture, x and y in [0,1] from the upper left corner: origin and unit
/// direction.
std::pair<dvec3, dvec3> camera_ray(const Camera& camera, double aspect, double x, double y);

/// Returns unit directions that are spread evenly over the sphere (spherical Fibonacci points).
std::vector<dvec3> sphere_directions(int count);

/// Returns those of `points` fixed random points in the lower part of the bounds from which nearly all rays
/// meet surfaces, most of them front faces. Solid objects show their back faces inside.
std::vector<dvec3> enclosed_places(const rays::SceneProbe& probe, int points);

/// Returns the camera that shows most. `aspect` is the picture's width / height. With `turns`, the scene stays in the
/// picture while the camera turns about it.
///
/// From outside, framing_camera() frames all vertices, or smaller boxes that leave out a share of them on each side, if
/// those show clearly more. From inside, cameras at enclosed places look horizontally, with a vertical field of view of
/// 60 degrees. The view inside is taken if it shows more than that from outside, by a margin that shrinks as more of
/// the bounds is enclosed. Scenes in pages are always seen from outside.
DefaultCamera default_camera(const rays::SceneProbe& probe, double aspect, View view = View::automatic,
                             bool turns = false);

/// Returns a camera turned about the vertical axis through a point; positive angles (radians) turn it to the right as
/// it looks at that point.
Camera turned(const Camera& camera, const dvec3& pivot, double angle);

}  // namespace halflight
