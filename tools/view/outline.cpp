#include "tools/view/outline.h"

#include <utility>

namespace halflight::view {
namespace {

constexpr std::size_t kMostTriangles = 200'000;  // objects of more triangles are shown by their box

/// Adds the edges of a box.
void add_box(const WorldBounds& box, const Projection& projection, std::vector<PictureLine>& lines) {
    const auto corner = [&](int i) {
        return projection.to_camera(
            {i & 1 ? box.upper.x : box.lower.x, i & 2 ? box.upper.y : box.lower.y, i & 4 ? box.upper.z : box.lower.z});
    };
    for (int i = 0; i < 8; ++i)
        for (const int bit : {1, 2, 4})
            if ((i & bit) == 0) projection.add_line(corner(i), corner(i | bit), lines);
}

}  // namespace

bool Outline::Key::operator==(const Key& o) const {
    return selection == o.selection && scene == o.scene && size == o.size && same(camera, o.camera) &&
           surfaces == o.surfaces;
}

const std::vector<PictureLine>& Outline::lines(const Session& session, const ivec2& size) {
    Key key{session.selection, session.shared_scene(), surface_edits(session.edits_now()), session.camera(), size};
    if (key_ == key) return lines_;
    if (!key_ || key_->scene != key.scene) edges_.clear();
    key_ = std::move(key);
    lines_.clear();
    const std::vector<std::size_t> instances = session.selected_instances();
    const Scene& scene = session.scene();
    const Picker& picker = session.picker();
    const Projection projection(session.camera(), size);
    std::size_t triangles = 0;
    WorldBounds box;
    for (const std::size_t i : instances) {
        triangles += scene.meshes[static_cast<std::size_t>(picker.instances()[i].mesh)].triangles.size();
        box = united(box, picker.bounds(i));
    }
    if (triangles > kMostTriangles) {
        add_box(box, projection, lines_);
        return lines_;
    }
    Coverage coverage(size);
    std::vector<PictureLine> edges;
    for (const std::size_t i : instances) {
        const Instance& instance = picker.instances()[i];
        const auto mesh = static_cast<std::size_t>(instance.mesh);
        const MeshEdges& own = edges_.try_emplace(mesh, scene.meshes[mesh]).first->second;
        own.add_faces(instance.object_to_world, projection, coverage);
        own.add_outline(instance.object_to_world, projection, edges);
    }
    for (const PictureLine& edge : edges) coverage.add_outer_parts(edge, lines_);
    return lines_;
}

}  // namespace halflight::view
