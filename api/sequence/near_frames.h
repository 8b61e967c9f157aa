// Frames of a sequence that are denoised together with the frames near them.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "api/halflight/loaded_scene.h"
#include "api/sequence/noisy_files.h"
#include "renderer/noisy_frame.h"
#include "renderer/render_result.h"

namespace halflight {

/// Holds noisy frames as long as they are near the frame that was rendered last, so that each is rendered once. Files
/// may hold them, too (noisy_files.h).
class NearFrames {
  public:
    /// Steps of the renderer.
    struct Steps {
        /// Renders a frame without denoising it, and fills `noisy`. The scene keeps the pose of the frame.
        std::function<RenderResult(FrameNumber frame, NoisyFrame& noisy, const ProgressCallback& progress)> render;
        /// Denoises the noisy picture of a frame in place. Empty: it stays noisy.
        std::function<void(NoisyFrame& noisy, std::span<const NearFrame> near, RenderResult& result)> denoise;
        /// Returns the camera of the picture of a frame.
        std::function<Camera(FrameNumber frame)> camera;
        NoisyFiles* files = nullptr;  // files of noisy frames; null: there are none
    };

    /// Renders a frame, and those up to `reach` before and after it that are not held yet. Denoises the frame by those
    /// in which lights and materials emit as in the frame itself. A frame that stays noisy needs no others, so only
    /// neighbours that no other call renders are rendered, too (NoisyFiles::listed()). An interrupted result is
    /// incomplete.
    RenderResult render(LoadedScene& scene, FrameNumber frame, int reach, const Steps& steps,
                        const ProgressCallback& progress);
    /// Forgets all frames. The context must be current.
    void clear() { held_.clear(); }
    /// Returns the seconds that posing the scene for motion took in the last render().
    double load_seconds() const { return load_seconds_; }

  private:
    /// A frame that waits for the frames near it, and serves as their neighbour. Its picture is empty once it was
    /// denoised.
    struct Held {
        NoisyPicture picture;
        bool in_file = false;
        RenderResult& result() { return picture.result; }
        NoisyFrame& noisy() { return *picture.noisy; }
    };
    /// Result of obtain().
    enum class Obtained { yes, no, elsewhere };  // `no`: interrupted; elsewhere: another process renders the frame
    Obtained obtain(LoadedScene& scene, FrameNumber frame, int reach, const Steps& steps,
                    const ProgressCallback& progress);
    /// Renders a frame and holds it. Returns false if it was interrupted.
    bool hold(LoadedScene& scene, FrameNumber frame, int reach, const Steps& steps, const ProgressCallback& progress);
    NoisyPicture noisy(LoadedScene& scene, FrameNumber frame, int reach, const Steps& steps,
                       const ProgressCallback& progress);

    std::map<FrameNumber, Held> held_;  // frames that wait or serve, by number
    RenderResult stopped_;              // picture that was interrupted
    int rendered_ = 0;                  // number of frames that render() has rendered
    std::uint64_t choice_ = 0;          // LoadedScene::choice_revision() of the held frames
    double load_seconds_ = 0;
};

}  // namespace halflight
