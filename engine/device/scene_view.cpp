#include "engine/device/scene_view.h"

namespace halflight {

gpu::Defines SceneView::shading_defines() const {
    gpu::Defines defines = scene.defines();
    if (scene.tiles()) defines.set("HALFLIGHT_TILE_REQUESTS");
    return defines;
}

void SceneView::shade(const gpu::Program& kernel, const std::function<void()>& all) const {
    scene.tiles() ? scene.tiles()->shade(kernel, band.paths(), all) : all();
}

}  // namespace halflight
