// The scene that a command line asks for, as it is at a time.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <vector>

#include "engine/core/frames.h"
#include "engine/io/gltf/gltf.h"
#include "renderer/render.h"
#include "tools/halflight/arguments.h"
#include "tools/halflight/camera.h"
#include "tools/halflight/console.h"

namespace halflight {

/// What it gives for a time is a function of the arguments and that time. Where the scene brings no light or no camera
/// of its own, those that take their place follow from the pose at 0 s.
class AnimatedScene {
  public:
    /// Reads the file; what loading mended or left out is said on the console. Throws Error: what load_gltf() throws,
    /// damaged animations, one that there is not (the error lists those that there are).
    AnimatedScene(const RenderArguments& arguments, const Console& console);

    /// As it was posed last, at first for 0 s.
    const Scene& scene() const { return scene_; }
    /// False where meshes, instances and lights of scene() stay as they are, and with them renderers: nothing of them
    /// moves, or it was posed for that time already. Cameras are told by camera(). Throws Error where the pose is at
    /// fault, and leaves scene() as it was.
    bool pose(double seconds);
    /// From now on pose() and posed() move vertices by this deformer (GltfScene), at 0 s too; null: by the CPU again.
    /// Where surfaces_move() alone.
    void deform_by(Deformer* deformer);
    /// As it is at another time, without an environment. Where surfaces_move() alone. Throws what pose() does.
    Scene posed(double seconds);
    /// Whether pose() can ever return true.
    bool surfaces_move() const { return surfaces_move_; }
    ChosenCamera camera(double seconds);
    const ChosenCamera& chosen_camera() const { return camera_; }  ///< at 0 s
    /// That is asked for, else that of the file's extras, else 24.
    const FrameRate& frame_rate() const { return frame_rate_; }
    /// Indices of the animations that play.
    const std::vector<std::size_t>& playing() const { return playing_; }
    /// Files that the scene is made of, its own first.
    const std::vector<std::filesystem::path>& files() const { return files_; }

  private:
    std::optional<GltfScene> file_;  // while something moves
    FrameRate frame_rate_;
    std::vector<std::size_t> playing_;
    std::vector<std::filesystem::path> files_;
    Scene scene_;
    SceneEdits edits_;
    ChosenCamera camera_;
    bool surfaces_move_ = false;
    std::optional<double> posed_at_ = 0;  // seconds; none: by another deformer
};

/// What a picture of frame `frame` differs in from others of the run: its number, its camera and, where the layer
/// "motion" is asked for, the camera of the frame before.
void set_frame(RenderSettings& settings, AnimatedScene& scene, std::uint32_t frame);

}  // namespace halflight
