// Live objects that a picture reads and updates beside its settings, which are values.
#pragma once

#include <functional>
#include <optional>
#include <span>

#include "engine/scene/motion.h"
#include "engine/scene/scene.h"

namespace halflight {

class Checkpoint;
class NoisyFrame;
class PictureHistory;

/// Objects of a picture. They must outlive the call of Renderer::render().
struct PictureInputs {
    const PreviousSurfaces* previous_surfaces = nullptr;  // surfaces of the previous frame; null: none has moved
    // Motion blur (SceneSettings::shutter_times): poses the scene at a share of the opening time, [0,1), and returns
    // the camera at that time; none: at the time of the frame itself. Exceptions end the picture. Empty: all samples
    // show the pose of the frame.
    std::function<Camera(std::optional<double> at)> pose{};
    // History of Preview::temporal: light of earlier pictures, which this picture reads and updates; null: none.
    PictureHistory* history = nullptr;
    // Keeps the noisy picture for Renderer::denoise(); null: a picture that is denoised is denoised at once.
    NoisyFrame* noisy = nullptr;
    // Saves the sums of the samples, and goes on from those that an earlier run has saved; null: does neither.
    Checkpoint* checkpoint = nullptr;
    // Complete checkpoints of all parts of the samples, in order, whose sums make the picture; empty: it is rendered.
    std::span<const Checkpoint* const> merged{};
};

}  // namespace halflight
