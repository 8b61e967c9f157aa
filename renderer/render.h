// The renderer: a scene, settings, pictures.
#pragma once

#include <memory>
#include <string>

#include "engine/color/color.h"
#include "engine/device/prepared_scene.h"
#include "engine/gpu/context.h"
#include "engine/scene/scene.h"
#include "engine/settings/layers.h"
#include "engine/settings/render_settings.h"
#include "renderer/render_result.h"

namespace halflight {

/// Renders pictures of a scene, one after the other. Visibility state and measured run times are carried from band to
/// band and from picture to picture. They affect time only: a picture is a function of scene and settings, whatever was
/// rendered before, except in preview modes. The context must be current on the calling thread throughout its life.
class Renderer {
  public:
    /// Shares a prepared scene, which must outlive the renderer. Throws Error for settings out of range, for raster
    /// culling of a scene that was prepared without it, and where limits of the driver are exceeded.
    Renderer(PreparedScene&, const ColorConfig&, RenderSettings);
    /// Prepares a scene of its own. The context must outlive the renderer.
    Renderer(gpu::Context&, const Scene&, const ColorConfig&, const RenderSettings&);
    Renderer(Renderer&&) noexcept;
    ~Renderer();

    /// Renders a picture. Throws Error for settings out of range.
    RenderResult render(const FrameSettings&, const ProgressCallback& = {});
    /// Renders the picture of the RenderSettings.
    RenderResult render(const ProgressCallback& = {});
    /// Changes the pose of a scene of its own (PreparedScene::update). Visibility state and run times are kept where
    /// the pose needs no other shaders or buffers; the radiance cache is cleared. Throws Error; after that the renderer
    /// may only be destroyed.
    void update(const Scene&);
    /// Follows a shared scene after PreparedScene::update() has returned true, in the same way.
    void follow_scene();
    /// Forgets visibility state, run times and the radiance cache, as after a camera cut. Other scenes and sizes need
    /// another renderer.
    void forget(std::string reason);
    /// Returns the compiled frame graph in the dot language of Graphviz.
    std::string graph_dot() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace halflight
