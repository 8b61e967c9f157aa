// Makes scenes of few triangles with known results, for tests of passes.
#pragma once

#include "tests/support/scenes.h"

namespace halflight::test {

/// Returns a rotated and tilted quad of 3 x 2 around `centre`, which the camera sees completely from about 4 units
/// away. Its vertex normals differ from the face normal and from each other.
Scene tilted_quad(const dvec3& centre = dvec3(0));
/// Returns a perspective camera, or an orthographic one with about the same view.
Camera camera_on_quad(const dvec3& centre = dvec3(0), bool orthographic = false);

/// Returns five instances of a pyramid-like mesh: plain, rotated, scaled non-uniformly, mirrored, and mirrored and
/// rotated.
Scene pyramids();
Camera camera_on_pyramids();

/// Returns an orthographic camera with a view of `size` around `at`, which it sees from direction `towards_camera`.
Camera spot_camera(const dvec3& at, const dvec3& towards_camera, double size);

/// Returns a square floor at y = 0, whose coordinates reach from -reach to reach. Hits on a floor of the default size
/// have errors of about 5e-4, which show in glossy light.
Scene floor_scene(const Material& material, float reach = 1000);

/// Returns a scene with every texture slot, wrap mode and texture transform, normal maps, vertex colours, an
/// environment map and a camera. The scenes of scenes/ have few of these.
Scene textured_scene();
/// Returns masked and blended curtains, one of them emissive, under lamps and a sky, with a camera.
Scene curtain_scene();
/// Returns rotated, scaled and mirrored pyramids, one of them emissive, under all kinds of punctual lights, with a
/// camera.
Scene instanced_scene();

/// Returns a lamp of radiance 1 that is `width` pixels wide and 8 pixels long, in the upper half of its camera's
/// picture of `side` x `side` pixels. Its light is 8 `width` pixels. A ragged lamp in the lower half keeps other blocks
/// busy.
Scene thin_strip(double width, int side);

/// Returns the Cornell box with a tall box of rough metal, under a dim sky.
Scene shiny_cornell();

/// Returns a closed box [-1, 1]^3 of one material, and a camera inside without a symmetric view.
Scene closed_box(const Material& material);
Camera camera_in_box();

}  // namespace halflight::test
