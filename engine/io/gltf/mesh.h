// Meshes: primitives to triangles, with morph targets and skins applied.
#pragma once

#include <compare>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/io/gltf/primitive.h"

namespace halflight {

/// Where a mesh's vertices are moved to while it is made; nowhere without joints.
struct GltfPose {
    std::vector<dmat4> joints;
    bool skin = false;  // JOINTS_n and WEIGHTS_n say which joints a vertex follows; otherwise all follow joints[0]
};

struct GltfPrimitiveKey {
    std::size_t mesh;
    std::size_t primitive;
    bool skinned;
    auto operator<=>(const GltfPrimitiveKey&) const = default;
};
/// Those that are kept from pose to pose.
using GltfPrimitives = std::map<GltfPrimitiveKey, std::shared_ptr<const GltfPrimitive>>;

/// A mesh before its vertices are moved.
struct GltfUnposedMesh {
    struct Part {
        Mesh still;  // what no pose changes
        Deformation deformation;
        const GltfMaterial* material;  // null: the default
    };
    std::string name;
    std::vector<Part> parts;
    bool uses_default_material = false;  // its triangles get the index after the last material
};

class GltfMeshes {
  public:
    GltfMeshes(GltfDocument& document, const std::vector<GltfMaterial>& materials, SceneReport& report)
        : document_(document), materials_(materials), report_(report) {}

    /// Reads its primitives of triangles. `weights` are those of the morph targets; the pose must outlive what is
    /// returned. `kept`: where primitives are looked for and left for other poses; or null.
    GltfUnposedMesh open(std::size_t index, std::span<const double> weights, const GltfPose& pose,
                         GltfPrimitives* kept = nullptr);
    /// All triangles of it; none where its primitives make none. `moved`: what somebody has made of its deformations,
    /// in their order; without, deform() does it.
    Mesh finish(GltfUnposedMesh mesh, std::span<VertexArrays> moved = {});

  private:
    void finish(Mesh& part, const GltfMaterial* material);

    GltfDocument& document_;
    const std::vector<GltfMaterial>& materials_;
    SceneReport& report_;
};

}  // namespace halflight
