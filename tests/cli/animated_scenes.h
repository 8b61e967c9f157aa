// Writes small animated scenes to files.
#pragma once

#include <array>
#include <filesystem>

#include "engine/core/math.h"
#include "tests/unit/io/gltf_builder.h"

namespace halflight::test {

/// Adds an animation of one second that leads a property, such as "/materials/0/emissiveFactor", from its first to its
/// last value (KHR_animation_pointer). `type` is that of a value.
void animate_pointer(GltfBuilder& scene, const std::string& pointer, const char* type,
                     const std::vector<float>& values);

/// Writes a scene of three boxes on a floor under a lamp, one second long, at 24 frames per second. One box bends (a
/// skin of two joints, cubic and linear keys), one has a morph target, and one rotates. Cameras: "still" and "moving".
/// Animations: "bend", "breathe", "turn", and "fly", which moves the camera only.
std::filesystem::path write_animated_scene(const std::filesystem::path& folder);

/// Writes a scene with a lamp and a triangle that moves out of all bounds at 3 s, so that frame 3 at 1 frame per second
/// fails.
std::filesystem::path write_scene_with_bad_frame(const std::filesystem::path& folder);

/// Writes a scene with a box "blinking" in a room with a lamp. Its lids are yellow and its sides blue. Its scale is the
/// first of `scales` before 1 s, the second one until 2 s, and then the third.
std::filesystem::path write_blinking_scene(const std::filesystem::path& folder,
                                           const std::array<vec3, 3>& scales = {vec3(1), vec3(0), vec3(1)});

/// Writes a scene of a triangle on the floor under a lamp whose intensity, cd, goes from `first` at 0 s to `last` at 1 s.
std::filesystem::path write_fading_scene(const std::filesystem::path& folder, float first, float last);

/// Writes a scene with "slider", a square of side 1 and radiance 1 in the plane z = 0, seen by orthographic cameras of
/// 4 x 4 units. Animation "slide" moves it by 2 units per second along +x, through the middle at 1 s. Animation "pan"
/// moves the camera "panning" along -x at the same speed; the camera "still" is static. Animation "cut" moves the camera
/// "cutting" 10 units aside at 1 s, at once. `fps` is written to the extras
/// of the asset unless it is 0.
std::filesystem::path write_sliding_light(const std::filesystem::path& folder, double fps = 0);

}  // namespace halflight::test
