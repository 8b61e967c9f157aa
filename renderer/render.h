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

/// Renders one picture after the other. What it learns about visibility and about who traces fastest lives on from band
/// to band and from picture to picture, and decides about time alone: a picture is a function of scene and settings,
/// whatever was rendered before, preview modes apart. Needs its context current on the calling thread for as long as it
/// lives.
class Renderer {
  public:
    /// Shares a scene, which must outlive it. Throws Error for settings out of range, for raster culling of a scene
    /// that was prepared without it, and for limits of the driver.
    Renderer(PreparedScene&, const ColorConfig&, RenderSettings);
    /// Prepares a scene of its own. The context must outlive it.
    Renderer(gpu::Context&, const Scene&, const ColorConfig&, const RenderSettings&);
    Renderer(Renderer&&) noexcept;
    ~Renderer();

    /// Throws Error for settings out of range.
    RenderResult render(const FrameSettings&, const ProgressCallback& = {});
    /// The picture of the RenderSettings.
    RenderResult render(const ProgressCallback& = {});
    /// Of a renderer with a scene of its own: brings it to another pose (PreparedScene::update). What was learned of
    /// who traces fastest and of what is visible lives on where the pose needs no other shaders or buffers; the
    /// radiance cache is emptied. Throws Error; the renderer is of no use then.
    void update(const Scene&);
    /// Of a renderer that shares its scene, the same after an update() of that which has returned true.
    void follow_scene();
    /// Camera cut: the next picture has nothing in common with the last one, and what was learned is forgotten, the
    /// radiance cache with it. (Other scenes and sizes have renderers of their own.)
    void forget(std::string reason);
    /// The compiled frame graph in Graphviz' dot language.
    std::string graph_dot() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace halflight
