// The renderer, which makes pictures of a scene with given settings.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "engine/color/color.h"
#include "engine/device/prepared_scene.h"
#include "engine/gpu/context.h"
#include "engine/scene/scene.h"
#include "engine/settings/layers.h"
#include "engine/settings/render_settings.h"
#include "renderer/picture_inputs.h"
#include "renderer/render_result.h"

namespace halflight {

namespace rays {
class BatchServer;
}
class RadianceCache;
struct NearFrame;

/// Renders pictures of a scene, one after the other. Visibility state and measured run times are carried from band to
/// band and from picture to picture. They affect time only: a picture is a function of scene and settings, whatever was
/// rendered before, except in preview modes. The context must be current on the calling thread throughout its life.
class Renderer {
  public:
    /// Shares a scene, which must outlive the renderer. `server` serves all ray batches in place of the settings'
    /// culling, and must outlive the renderer; null: none. `cache` is that of Preview::cache, which
    /// renderers of one scene with the same number of bounces may share; pictures depend on earlier pictures made with
    /// it. Null: the renderer makes one. Throws Error for settings out of range, for limits of the driver, and for
    /// raster culling of a scene that was prepared without it. Throws Error also for an estimator that is left open
    /// (find_estimator() in pilot.h settles it).
    Renderer(PreparedScene&, const ColorConfig&, RenderSettings, rays::BatchServer* server = nullptr,
             std::shared_ptr<RadianceCache> cache = nullptr);
    /// Prepares a scene of its own. The context must outlive the renderer.
    Renderer(gpu::Context&, const Scene&, const ColorConfig&, const RenderSettings&);
    Renderer(Renderer&&) noexcept;
    ~Renderer();

    /// Renders a picture. Throws Error for settings out of range. An Interruptible (engine/core/interruption.h) can end
    /// it with an exception; other pictures can be rendered afterwards.
    RenderResult render(const FrameSettings&, const PictureInputs&, const ProgressCallback& = {});
    RenderResult render(const FrameSettings&, const ProgressCallback& = {});
    /// Renders the picture of the RenderSettings.
    RenderResult render(const ProgressCallback& = {});
    /// Denoises a picture that was rendered with PictureInputs::noisy, with the frames near it
    /// (renderer/noisy_frame.h).
    void denoise(NoisyFrame& frame, std::span<const NearFrame> near, RenderResult& result);
    /// Brings the renderer's own scene to another pose (PreparedScene::update). Statistics of tracing speed and
    /// visibility are kept if the pose needs no other shaders or buffers; the radiance cache is emptied. Throws
    /// Error; all further calls then throw Error, too.
    void update(const Scene&);
    /// Changes to the pose of a shared scene after its update() has returned true.
    void follow_scene();
    /// Forgets visibility state, run times and the radiance cache, as after a camera cut. Other scenes and sizes need
    /// another renderer.
    void forget(std::string reason);
    /// Returns the compiled frame graph in the dot language of Graphviz.
    std::string graph_dot() const;

  private:
    struct State;
    /// Makes the state anew if the camera has a lens that blurs, or optics that must be traced, and the last camera
    /// had none, or the reverse.
    void follow_camera(const Camera& camera);
    /// Throws Error if an update has failed.
    State& state() const;
    std::unique_ptr<State> state_;  // state; null if an update has failed
};

}  // namespace halflight
