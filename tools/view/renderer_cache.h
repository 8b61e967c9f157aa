// State of the render thread across requests: the prepared scene, and renderers by size.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "engine/scene/motion.h"
#include "passes/light/radiance_cache.h"
#include "renderer/preview_picture.h"
#include "tools/view/request.h"
#include "tools/view/resolution.h"

namespace halflight::view {

inline constexpr int kMatteSamples = 16;  ///< maximum samples of mattes

/// Owns the prepared scene and its renderers. Use it on the thread of its context only.
class RendererCache {
  public:
    /// The context must outlive this object. `budget` is that of Resolution, seconds.
    RendererCache(gpu::Context& context, ColorConfig colors, double budget)
        : context_(context),
          colors_(std::move(colors)),
          programs_(std::make_shared<gpu::ProgramCache>(context.binaries())),
          resolution_(budget) {}

    /// Returns whether prepare() will have to build the scene's tables and hierarchies.
    bool needs_scene(const Request& request) const;
    /// Recompiles programs whose shaders have changed; returns whether there were any. Throws what
    /// gpu::ProgramCache::reload() throws.
    bool reload_shaders();
    /// Prepares the scene of a request. Tables and hierarchies that edits and pose leave unchanged are kept. Throws
    /// what preparing a scene throws; there is no scene then until the next call.
    void prepare(const Request& request);
    /// Resolution and preview modes of a renderer.
    struct Kind {
        int divisor = 1;  ///< the size of the last prepared request is divided by it
        bool filtered = false;
        bool denoised = false;
        auto operator<=>(const Kind&) const = default;
    };
    /// Returns whether the first picture of this kind has not been made yet; it takes longer than others.
    bool is_new(const Kind& kind) const { return !renderers_.contains(kind); }
    /// Returns the renderer of this kind. Throws what a Renderer throws.
    Renderer& renderer(const Kind& kind);
    /// Returns the renderer for a region of the whole picture, without preview modes. The renderer of an earlier region
    /// is destroyed. Throws what a Renderer throws.
    Renderer& region_renderer(const PixelWindow& window);
    /// Returns whether the previous request showed the scene in another pose.
    bool pose_is_new() const { return previous_scene_ && previous_scene_ != request_.scene; }
    /// Makes mattes of the last prepared request, at its size divided by `divisor`. They have as many samples as the
    /// picture, but no more than kMatteSamples, from camera rays only.
    RenderResult mattes(int divisor, int samples, const std::vector<std::string>& aovs);
    Resolution& resolution() { return resolution_; }
    /// Fills in camera and frame of the last prepared request.
    void fill_frame_settings(FrameSettings& frame) const;
    /// Returns history and surfaces of the last prepared request. They are valid until the next call.
    PictureInputs inputs();

  private:
    /// Prepares the scene and removes renderers that cannot continue with it.
    void prepare_scene(const Request& request);
    void clear_renderers();
    RenderSettings settings(const Kind& kind) const;
    void remember_previous_view(const Request& request);

    gpu::Context& context_;
    ColorConfig colors_;
    Request request_;
    bool reloaded_ = false;  // shaders have been reloaded since the last prepare()
    // Programs outlive scenes: one that is loaded anew needs the same, and drivers keep memory of each that they
    // compile.
    std::shared_ptr<gpu::ProgramCache> programs_;
    std::unique_ptr<PreparedScene> scene_;
    bool raster_ = false;  // the scene is prepared for raster culling
    std::map<Kind, Renderer> renderers_;
    std::map<int, Renderer> matte_renderers_;  // keyed by divisor
    std::optional<std::pair<PixelWindow, Renderer>> region_renderer_;
    PictureHistory history_;  // pictures since the last prepare() that changed more than the camera
    // View of the previous request, to which the layer "motion" is relative.
    std::optional<Camera> previous_camera_;
    std::shared_ptr<const Scene> previous_scene_;
    std::shared_ptr<const SceneTree> previous_tree_;
    // Scenes with the edits that move or hide surfaces, to which `surfaces_` refers.
    std::shared_ptr<const Scene> moved_scene_, moved_previous_scene_;
    std::optional<PreviousSurfaces> surfaces_;       // surfaces at the previous request
    std::shared_ptr<RadianceCache> radiance_cache_;  // shared by the renderers; null until a request needs it
    Resolution resolution_;
};

}  // namespace halflight::view
