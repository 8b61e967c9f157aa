// Pictures of a loaded scene at single times.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "api/halflight/frame_renderer.h"
#include "engine/core/memory_ledger.h"
#include "engine/device/deform.h"
#include "engine/device/prepared_scene.h"
#include "passes/light/radiance_cache.h"
#include "renderer/memory.h"
#include "renderer/noisy_frame.h"
#include "renderer/preview_picture.h"
#include "renderer/render.h"

namespace halflight {

/// Returns a camera with lens and optics of the settings.
Camera equipped(const ChosenCamera& chosen, const RenderSettings& settings);

/// Brings a scene to the device and from pose to pose, and renders one picture of each pose. FrameRenderer makes frames
/// of these pictures. The prepared scene is kept from picture to picture, and enters the memory ledger.
class SceneRenderer {
  public:
    /// Takes device, colours and ray server of `options`. The owner may change `settings` between pictures as
    /// FrameRenderer does. Scene and settings must outlive the object. `dropped` is called after each drop(). Throws
    /// Error if there is no such device.
    SceneRenderer(LoadedScene& scene, const RenderSettings& settings, RendererOptions& options,
                  std::function<void()> dropped);
    SceneRenderer(const SceneRenderer&) = delete;
    SceneRenderer& operator=(const SceneRenderer&) = delete;
    ~SceneRenderer();  ///< Precondition: the context is current.

    /// Makes this renderer's context and deformer current; others may have used the scene or the thread. Every use
    /// begins with it. Applies changes of the scene's transforms.
    void begin();
    /// Drops the prepared scene; the next picture prepares it anew.
    void drop();

    /// Returns the estimator that find_estimator() has found.
    const std::optional<Estimator>& found() const { return found_; }
    /// Settles an open estimator as FrameRenderer::find_estimator() does.
    std::optional<Estimator> find_estimator(const std::function<bool(double)>& progress);
    /// Returns the exposure that metering finds, stops; none if `progress` has cancelled.
    std::optional<float> find_exposure(const std::function<bool(double)>& progress);

    /// Renders a picture of the scene at a time, seconds. Throws as FrameRenderer::render().
    RenderResult picture(double seconds, const FrameSettings& frame, PictureInputs inputs,
                         const ProgressCallback& progress);
    /// Renders a frame at its own time, with the motion of surfaces if a layer needs it.
    RenderResult still(FrameNumber frame, const FrameSettings& frame_settings, PictureInputs inputs,
                       const ProgressCallback& progress);
    /// Denoises a noisy picture of the pose with frames near it (Renderer::denoise()).
    void denoise(NoisyFrame& noisy, std::span<const NearFrame> others, RenderResult& result);

    const ColorConfig& colors() const { return colors_; }
    gpu::Context& context() const { return *context_; }
    /// Returns the deformer on the device; null if no mesh deforms.
    GpuDeformer* deformer() { return deformer_ ? &*deformer_ : nullptr; }
    PictureHistory& history() { return history_; }
    bool has_picture() const { return renderer_.has_value(); }
    /// Returns FrameRenderer::graph_dot(). Precondition: has_picture().
    std::string graph_dot() const { return renderer_->graph_dot(); }
    /// Returns the seconds that posing the scene took since the last call.
    double take_load_seconds() { return std::exchange(load_seconds_, 0); }

  private:
    template <class F>
    auto guarded(F f);
    RenderSettings renderer_settings(const FrameSettings& frame) const;
    PictureUse picture_use() const;
    void prepare();
    std::size_t choose_pool(const paging::PageIndex& index, const SceneNeeds& needs);
    void make_renderer(const FrameSettings& frame);
    void take_memory(RenderSettings& s);
    void pose(double seconds, const FrameSettings& frame);
    void pose_within(double seconds);
    void share_parts(const SceneNeeds& needs, double seconds, const FrameSettings& frame);
    RenderResult blurred(const FrameSettings& frame, PictureInputs inputs, const ProgressCallback& progress);

    LoadedScene& scene_;
    const RenderSettings& settings_;
    Shutter shutter_;
    int exr_tile_;  // RendererOptions::exr_tile
    RayServerFactory ray_server_;
    bool frees_scene_;
    std::function<void()> dropped_;
    ColorConfig colors_;
    std::shared_ptr<gpu::Context> context_;
    std::optional<GpuDeformer> deformer_;
    // The uploaded scene and the objects that render it. The next picture makes them anew if they are null.
    std::unique_ptr<PreparedScene> prepared_;
    std::shared_ptr<rays::BatchServer> server_;
    std::shared_ptr<RadianceCache> cache_;  // radiance cache; null without Preview::cache
    std::optional<Renderer> renderer_;
    MemoryLedger::Entry tables_memory_, pages_memory_, pool_memory_, textures_memory_, picture_memory_, bands_memory_,
        visibility_memory_;
    std::size_t pool_size_ = 0;       // memory for pages, bytes; 0: not chosen yet
    std::uint64_t uploaded_ = 0;      // LoadedScene::revision() of the uploaded scene
    std::uint64_t transforms_ = 0;    // LoadedScene::transform_revision() of the uploaded scene
    SceneEdits edits_;                // edits of the last picture
    std::optional<Estimator> found_;  // result of the pilot
    PictureHistory history_;          // light and geometry of the last frame, for RenderSettings::preview
    double load_seconds_ = 0;
    double reference_seconds_ = 0;  // time to prepare the reference pose, counted with the next picture
    bool at_reference_ = false;     // `prepared_` holds the reference pose
    double posing_seconds_ = 0;     // time of the poses of a picture with motion blur
    rays::HierarchyCounts posed_hierarchies_;
    bool posed_ = true;    // false: a pose within a picture has failed
    bool shares_ = false;  // PreparedScene::share() was called for the last picture
};

}  // namespace halflight
