#include "engine/device/scene_view.h"

#include "engine/paging/row_gather.h"

namespace halflight {

rays::PassBacks SceneView::pass_backs(rays::RayKind kind) const {
    using enum rays::PassBacks;
    if (!trace.one_sided() || backfaces == Backfaces::show) return none;
    if (backfaces == Backfaces::cull) return all;
    switch (kind) {
        case rays::RayKind::primary:
        case rays::RayKind::specular:
            return all;
        case rays::RayKind::glossy:
        case rays::RayKind::continuation:
            return scene.needs().sharp ? marked : none;
        default:
            return none;
    }
}

bool SceneView::passes_panes(rays::RayKind kind) const {
    switch (kind) {
        case rays::RayKind::shadow:
        case rays::RayKind::sun:
        case rays::RayKind::diffuse:
        case rays::RayKind::glossy:
        case rays::RayKind::continuation:
            return scene.needs().panes;
        default:
            return false;
    }
}

gpu::Defines SceneView::camera_defines(gpu::Defines others) const {
    if (lens) others.set("HALFLIGHT_LENS");
    if (optics) others.set("HALFLIGHT_OPTICS");
    return others;
}

std::function<void(graph::Resources&, const gpu::Program&)> SceneView::bind_scene() const {
    return [&scene = scene](graph::Resources&, const gpu::Program&) { scene.bind(); };
}

std::function<void(graph::Resources&, const gpu::Program&)> SceneView::bind_hits() const {
    return [&scene = scene, rows = rows](graph::Resources&, const gpu::Program&) {
        scene.bind();
        if (rows) rows->bind();
    };
}

void SceneView::read_frame(graph::Pass& pass) const {
    pass.read(frame_constants, graph::Access::uniform_read, "FrameBlock");
    if (sampled_blocks) pass.read(sampled_blocks, graph::Access::texture_read, {"sampled_blocks", GL_RGBA32UI});
}

gpu::Defines SceneView::path_defines() const {
    gpu::Defines defines = scene.defines();
    if (sampled_blocks) defines.set("HALFLIGHT_SAMPLED_BLOCKS");
    if (const rays::PassBacks of_paths = pass_backs(rays::RayKind::continuation); of_paths != rays::PassBacks::none)
        defines.set("HALFLIGHT_BACKFACES", static_cast<int>(of_paths));
    if (light_groups > 0) defines.set("HALFLIGHT_LIGHT_GROUPS", light_groups);
    return defines;
}

gpu::Defines SceneView::shading_defines() const {
    gpu::Defines defines = path_defines();
    if (scene.tiles()) defines.set("HALFLIGHT_TILE_REQUESTS");
    return defines;
}

void SceneView::shade(const gpu::Program& kernel, const std::function<void()>& all) const {
    scene.tiles() ? scene.tiles()->shade(kernel, band.paths(), all) : all();
}

}  // namespace halflight
