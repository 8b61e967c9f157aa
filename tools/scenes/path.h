// A scene with one more camera, which flies: what renderers of sequences are measured on.
#pragma once

#include <filesystem>
#include <string>

namespace halflight::scenes {

struct PathOptions {
    std::string camera;   // of the scene, which the flight goes by; empty: the first one
    int frames = 48;      // > 1; a key for each, frame 0 at 0 s
    double fps = 24;      // > 0
    double degrees = 24;  // of the arc, around the middle of what the camera sees, half to each side of it
};

/// Copies a .glb, with a camera "path" that the animation "path" moves. Throws Error where the scene cannot be read, is
/// no .glb with its data inside, or has no perspective camera of that name.
void write_camera_path(const std::filesystem::path& scene, const std::filesystem::path& out,
                       const PathOptions& options);

}  // namespace halflight::scenes
