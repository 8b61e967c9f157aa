// Meshes: primitives to triangles, with morph targets and skins applied.
#pragma once

#include <span>
#include <vector>

#include "engine/io/gltf_accessor.h"
#include "engine/io/gltf_material.h"

namespace halflight {

/// Where a mesh's vertices are moved to while it is made; nowhere without joints.
struct GltfPose {
    std::vector<dmat4> joints;
    bool skin = false;  // JOINTS_n and WEIGHTS_n say which joints a vertex follows; otherwise all follow joints[0]
};

class GltfMeshes {
  public:
    GltfMeshes(GltfDocument& document, const std::vector<GltfMaterial>& materials, SceneReport& report)
        : document_(document), accessors_(document), materials_(materials), report_(report) {}

    /// All triangles of a mesh; none where its primitives make none. Where a primitive has no material its triangles
    /// get the index after the last one. `weights` are those of the morph targets.
    Mesh convert(std::size_t index, std::span<const double> weights, const GltfPose& pose);

    /// Whether the mesh converted last has such primitives.
    bool used_default_material() const { return used_default_material_; }

  private:
    struct Source;  // a primitive, and the range of its vertices that triangles use
    void add_primitive(Mesh& mesh, Source source, std::span<const double> weights, const GltfPose& pose);
    std::vector<uvec3> read_triangles(Source& source);
    void check_count(const Source& source, int accessor, std::string_view attribute) const;
    template <class V>
    std::vector<V> read(const Source& source, const std::string& attribute, bool normalize = false) const;
    void read_attributes(Mesh& part, const Source& source);
    void morph(Mesh& part, const Source& source, std::span<const double> weights);
    void apply_pose(Mesh& part, const Source& source, const GltfPose& pose);
    void finish(Mesh& part, const Source& source);

    GltfDocument& document_;
    const GltfAccessors accessors_;
    const std::vector<GltfMaterial>& materials_;
    SceneReport& report_;
    bool used_default_material_ = false;
};

}  // namespace halflight
