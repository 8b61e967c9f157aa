#include "passes/light/diffuse.h"

namespace halflight {

PathList add_diffuse(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer, PathBuffers& paths) {
    return add_first_scatter(graph, view, gbuffer, {"diffuse", "shaders/diffuse.comp", rays::RayKind::diffuse}, paths);
}

}  // namespace halflight
