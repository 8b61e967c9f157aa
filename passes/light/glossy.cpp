#include "passes/light/glossy.h"

namespace halflight {

PathList add_glossy(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer, PathBuffers& paths) {
    return add_first_scatter(graph, view, gbuffer, {"glossy", "shaders/glossy.comp", rays::RayKind::glossy}, paths);
}

}  // namespace halflight
