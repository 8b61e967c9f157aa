// Small animated scenes as files.
#pragma once

#include <filesystem>

namespace halflight::test {

/// A box that bends (a skin of two joints, cubic and linear keys), one that breathes (a morph target) and one that
/// turns, on a floor under a lamp; cameras "still" and "moving"; a second at 24 frames per second. Animations "bend",
/// "breathe", "turn" and "fly", which moves the camera alone.
std::filesystem::path write_animated_scene(const std::filesystem::path& folder);

/// A lamp and a triangle that is thrown beyond all bounds at 3 s: what frame 3 shows at 1 frame per second cannot be
/// made.
std::filesystem::path write_scene_with_bad_frame(const std::filesystem::path& folder);

/// A square of side 1 that shines with radiance 1, "slider", on the plane z = 0 in the view of orthographic cameras
/// that see 4 x 4 units. Animation "slide" moves it by 2 units a second along +x, so that it is in the middle at 1 s;
/// "pan" moves the camera "panning" along -x likewise. The camera "still" does not move. fps: in the extras of its
/// asset, 0: none.
std::filesystem::path write_sliding_light(const std::filesystem::path& folder, double fps = 0);

}  // namespace halflight::test
