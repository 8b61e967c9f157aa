// Frames of a sequence that are denoised together with the frames near them.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "api/halflight/loaded_scene.h"
#include "renderer/noisy_frame.h"
#include "renderer/render_result.h"

namespace halflight {

/// Holds noisy frames as long as they are near the frame that was rendered last, so that each is rendered once.
class NearFrames {
  public:
    /// Steps of the renderer.
    struct Steps {
        /// Renders a frame without denoising it, and fills `noisy`. The scene keeps the pose of the frame.
        std::function<RenderResult(std::uint32_t frame, NoisyFrame& noisy, const ProgressCallback& progress)> render;
        /// Denoises the noisy picture of a frame in place.
        std::function<void(NoisyFrame& noisy, std::span<const NearFrame> near, RenderResult& result)> denoise;
        /// Returns the camera of the picture of a frame.
        std::function<Camera(std::uint32_t frame)> camera;
    };

    /// Renders a frame, and those up to `reach` before and after it that are not held yet. Denoises the frame by those
    /// in which lights and materials emit as in the frame itself. An interrupted result is incomplete.
    RenderResult render(LoadedScene& scene, std::uint32_t frame, int reach, const Steps& steps,
                        const ProgressCallback& progress);
    /// Forgets all frames. The context must be current.
    void clear() { held_.clear(); }
    /// Returns the seconds that posing the scene for motion took in the last render().
    double load_seconds() const { return load_seconds_; }

  private:
    /// A frame that waits for the frames near it, and serves as their neighbour.
    struct Held {
        RenderResult result;  // the noisy picture; empty once it was denoised
        std::unique_ptr<NoisyFrame> noisy;
        std::set<std::uint32_t> lit_otherwise{};  // frames near it in which lights or materials emit otherwise
    };
    Held noisy(LoadedScene& scene, std::uint32_t frame, std::span<const std::uint32_t> frames, const Steps& steps,
               const ProgressCallback& progress);

    std::map<std::uint32_t, Held> held_;  // frames that wait or serve, by number
    std::uint64_t choice_ = 0;            // LoadedScene::choice_revision() of the held frames
    double load_seconds_ = 0;
};

}  // namespace halflight
