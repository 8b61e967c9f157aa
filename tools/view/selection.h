// The object that is selected in the viewer, and the outlines of meshes. Uses no window.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "tools/view/coverage.h"

namespace halflight::view {

enum class ObjectKind { none, node, mesh, light, material, camera, environment };

struct Selection {
    ObjectKind kind = ObjectKind::none;
    std::size_t index = 0;  // index into the list of the scene, or of SceneTree::nodes
    bool operator==(const Selection&) const = default;
};

/// The edges of a mesh, from which outlines are found for each view. Vertices at the same place count as one.
class MeshEdges {
  public:
    explicit MeshEdges(const Mesh& mesh);
    /// Adds the outline of an instance: edges between faces that are seen from the front and from behind, and edges of
    /// a single face.
    void add_outline(const dmat4& object_to_world, const Projection& projection, std::vector<PictureLine>& lines) const;
    /// Adds the faces of an instance.
    void add_faces(const dmat4& object_to_world, const Projection& projection, Coverage& coverage) const;

  private:
    std::vector<dvec3> in_camera(const dmat4& object_to_world, const Projection& projection) const;

    struct Side {
        std::uint32_t a, b;  // vertices, a < b
        std::uint32_t face;
    };
    std::vector<dvec3> points_;  // distinct vertices, object space
    std::vector<uvec3> faces_;
    std::vector<Side> sides_;  // sides of faces, those of an edge next to each other
};

}  // namespace halflight::view
