// Conversion of primitives to meshes of triangles, with morph targets and skins applied.
#pragma once

#include <compare>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/io/gltf/primitive.h"
#include "engine/scene/geometry.h"

namespace halflight {

/// Transforms of a mesh's vertices; without joints the vertices do not move.
struct GltfPose {
    std::vector<Joint> joints;
    bool skin = false;  // JOINTS_n and WEIGHTS_n are applied; otherwise all vertices follow joints[0]
};

struct GltfPrimitiveKey {
    std::size_t mesh;
    std::size_t primitive;
    bool skinned;
    auto operator<=>(const GltfPrimitiveKey&) const = default;
};
/// Primitives kept from pose to pose.
using GltfPrimitives = std::map<GltfPrimitiveKey, std::shared_ptr<const GltfPrimitive>>;

/// A mesh before its vertices are moved.
struct GltfUnposedMesh {
    struct Part {
        Mesh still;                     // the parts that no pose changes
        std::vector<vec2> tangent_uvs;  // GltfPrimitive::tangent_uvs
        Deformation deformation;
        const GltfMaterial* material;  // material of the primitive; null: the default
    };
    std::string name;
    std::vector<Part> parts;
    bool uses_default_material = false;  // true: triangles get the index after the last material
};

class GltfMeshes {
  public:
    GltfMeshes(GltfDocument& document, const std::vector<GltfMaterial>& materials, SceneReport& report)
        : document_(document), materials_(materials), report_(report) {}

    /// Returns the name of a mesh.
    std::string name(std::size_t index) const;
    /// Reads the triangle primitives of a mesh. `weights` are those of the morph targets; the pose must outlive the
    /// result. `kept` is a cache of primitives for other poses, or null.
    GltfUnposedMesh open(std::size_t index, std::span<const double> weights, const GltfPose& pose,
                         GltfPrimitives* kept = nullptr);
    /// Returns the mesh with all its triangles, or without any if its primitives have none. `moved` are the results of
    /// its deformations, in their order; without them, deform() is used.
    Mesh finish(GltfUnposedMesh mesh, std::span<VertexArrays> moved = {});
    /// Returns MeshSource::all_parts() of a mesh.
    static Mesh all_parts(const GltfUnposedMesh& mesh);

  private:
    /// Repairs a posed part, and makes what it lacks. Triangles that the pose mirrors get the other winding, so that
    /// their front stays outside.
    void finish(Mesh& part, const GltfMaterial* material, bool deforms, VertexExtras extras);
    void add_tangents(Mesh& part, const GltfMaterial* material, bool deforms, const VertexExtras& extras);

    GltfDocument& document_;
    const std::vector<GltfMaterial>& materials_;
    SceneReport& report_;
};

}  // namespace halflight
