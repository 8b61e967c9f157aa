// The scenes that this project makes for itself. scenes/README.md says what each is for.
#pragma once

#include "tools/scenes/document.h"

namespace halflight::scenes {

/// The Cornell box; all of it diffuse, or with two metal boxes.
Document cornell(bool metal_boxes);

/// A closed box that emits 1 - albedo and reflects albedo, around spheres that reflect everything: the radiance is 1
/// at every point in every direction. Precondition: 0 <= albedo < 1.
Document furnace(double albedo);

/// A courtyard of two storeys under sun and sky; about 80 000 triangles.
Document atrium_scene();

/// Metals, coats, ceramics and a frosted pane on a table, under two area lights.
Document still_life();

/// A room lit through one small window: the hard case for indirect light.
Document room();

/// A hall of 60 x 60 x 8 m with `lights` small square lamps of mixed size, radiance, colour and orientation, two
/// emissive triangles each, which together shine about the same however many they are. `triangles`: of the whole,
/// exactly; 0: 10 000 for what is no lamp and no wall. Throws Error where lamps and walls alone are more. Precondition:
/// lights > 0.
Document emitters(int lights, std::uint64_t triangles);

/// An eel that swims above a floor: a skinned mesh of about so many triangles, in one animation of 2 seconds.
Document eel(std::uint64_t triangles);

}  // namespace halflight::scenes
