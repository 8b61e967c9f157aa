// Scenes for tests of passes: few triangles, known answers.
#pragma once

#include "tests/support/scenes.h"

namespace halflight::test {

/// A turned and tilted quad of 3 x 2 around `centre`, seen whole by the camera from some 4 units away. Its vertex
/// normals differ from the face's and from each other.
Scene tilted_quad(const dvec3& centre = dvec3(0));
/// Perspective, or orthographic with about the same view.
Camera camera_on_quad(const dvec3& centre = dvec3(0), bool orthographic = false);

/// One pyramid-like mesh five times: plain, turned, scaled unevenly, mirrored, and mirrored and turned.
Scene pyramids();
Camera camera_on_pyramids();

/// Orthographic camera that looks at a spot of `size` around `at` from direction `towards_camera`.
Camera spot_camera(const dvec3& at, const dvec3& towards_camera, double size);

/// A floor of 2000 x 2000 at y = 0.
Scene floor_scene(const Material& material);

/// What the scenes of scenes/ have little of, each with a camera: every texture slot, wrap and transform, with normal
/// maps, vertex colours and an environment map;
Scene textured_scene();
/// masked and blended curtains, one of which glows, in the light of lamps and sky;
Scene curtain_scene();
/// pyramids turned, scaled and mirrored, one of them emissive, under all kinds of punctual lights.
Scene instanced_scene();

/// The Cornell box with a tall box of rough metal, under a dim sky.
Scene shiny_cornell();

/// Closed box [-1, 1]^3, all walls of one material, and a camera in it that sees no symmetry.
Scene closed_box(const Material& material);
Camera camera_in_box();

}  // namespace halflight::test
