// The scenes of this project; scenes/README.md describes them.
#pragma once

#include "tools/scenes/document.h"

namespace halflight::scenes {

/// Makes the Cornell box, entirely diffuse or with two metal boxes.
Document cornell(bool metal_boxes);

/// Makes a closed box that emits 1 - albedo and reflects albedo, around spheres that reflect everything: the radiance
/// is 1 at every point in every direction. Precondition: 0 <= albedo < 1.
Document furnace(double albedo);

/// Makes a courtyard of two storeys under sun and sky; about 80 000 triangles.
Document atrium_scene();

/// Makes metals, coats, ceramics and a frosted pane on a table, under two area lights.
Document still_life();

/// Makes a room lit through one small window, a hard case for indirect light.
Document room();

/// Makes a hall of 60 x 60 x 8 m with `lights` > 0 small square lamps of mixed size, radiance, colour and orientation.
/// Each lamp has two triangles; the power of all lamps together hardly depends on their number. `triangles` is the
/// exact number of the whole hall; 0: 10 000 besides lamps and walls. Throws Error if lamps and walls alone have
/// more.
Document emitters(int lights, std::uint64_t triangles);

/// Makes three lamps, left, middle and right, before a wall.
Document lamps();

/// Makes an eel that swims above a floor: a skinned mesh of about `triangles` triangles, in one animation of 2 seconds.
Document eel(std::uint64_t triangles);

}  // namespace halflight::scenes
