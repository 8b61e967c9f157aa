// Adds a camera that flies to a scene, for measuring sequences.
#pragma once

#include <filesystem>
#include <string>

namespace halflight::scenes {

struct PathOptions {
    std::string camera;   // camera of the scene at the middle of the flight; empty: the first one
    int frames = 48;      // number of frames, > 1; each has a key, frame 0 at 0 s
    double fps = 24;      // frames per second, > 0
    double degrees = 24;  // angle of the arc around the middle of the view, half to each side
};

/// Copies a .glb and adds a camera "path" that the animation "path" moves. Throws Error if the scene cannot be read,
/// is no .glb with its data inside, or has no perspective camera of that name.
void write_camera_path(const std::filesystem::path& scene, const std::filesystem::path& out,
                       const PathOptions& options);

}  // namespace halflight::scenes
