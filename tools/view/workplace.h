// What the render thread keeps from request to request: the prepared scene, and renderers by size.
#pragma once

#include <map>
#include <memory>
#include <optional>

#include "engine/scene/motion.h"
#include "passes/light/radiance_cache.h"
#include "renderer/preview_picture.h"
#include "tools/view/render_thread.h"
#include "tools/view/resolution.h"

namespace halflight::view {

/// On the thread of its context.
class Workplace {
  public:
    /// The context must outlive it. `budget` as of Resolution.
    Workplace(gpu::Context& context, ColorConfig colors, double budget)
        : context_(context), colors_(std::move(colors)), resolution_(budget) {}

    /// Whether prepare() will have to make the scene's tables and hierarchies.
    bool needs_scene(const Request& request) const;
    /// Programs of shaders that have changed are compiled anew; whether there were any. Throws what
    /// gpu::ProgramCache::reload() throws.
    bool reload_shaders();
    /// Of a scene that has other edits, or is in another pose, all that can stay is kept. Throws what preparing a scene
    /// throws; then there is none until the next call.
    void prepare(const Request& request);
    /// Whether the first picture of this size is still to be made, which takes longer than others.
    bool is_new(int divisor) const { return !renderers_.contains(divisor); }
    /// Of the size of the request that was prepared last. Throws what a Renderer throws.
    Renderer& renderer(int divisor);
    Resolution& resolution() { return resolution_; }
    /// What a renderer is told of the picture of the request that was prepared last: its camera, its place in time and
    /// what was seen before it. Until the next call.
    void tell(FrameSettings& frame);

  private:
    /// Renderers that cannot go on are gone afterwards.
    void prepare_scene(const Request& request);
    void look_back(const Request& request);

    gpu::Context& context_;
    ColorConfig colors_;
    Request request_;
    bool reloaded_ = false;  // shaders, since the last prepare()
    std::unique_ptr<PreparedScene> scene_;
    bool raster_ = false;                // the scene is prepared for raster culling
    std::map<int, Renderer> renderers_;  // by divisor
    PictureHistory history_;             // of the pictures since the last prepare() that changed more than the camera
    // For the layer "motion", which is that since the request before this one.
    std::optional<Camera> previous_camera_;
    std::shared_ptr<const Scene> previous_scene_;
    std::optional<PreviousSurfaces> surfaces_;       // of the picture in the making, whose scene is that of request_
    std::shared_ptr<RadianceCache> radiance_cache_;  // that they share; null until one is wanted
    Resolution resolution_;
};

}  // namespace halflight::view
