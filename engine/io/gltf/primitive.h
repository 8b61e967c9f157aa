// Primitives of triangles, before a pose says where their vertices are.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/io/gltf/accessor.h"
#include "engine/io/gltf/material.h"
#include "engine/scene/deformer.h"

namespace halflight {

/// The texture that a material's tangents are for; null where it needs none, or is none.
const TextureRef* normal_map_of(const GltfMaterial* material);

class GltfPrimitive final : public RestShape {
  public:
    /// Reads what no pose changes. `material`: null for the default one, whose index is `material_index` all the same.
    /// `skinned`: whether JOINTS_n and WEIGHTS_n tell which joints vertices follow. The document outlives it. Throws
    /// Error: indices out of range, attributes of different lengths, damaged accessors, skinned without joints.
    GltfPrimitive(const GltfDocument& document, const tinygltf::Primitive& primitive, std::string element,
                  const GltfMaterial* material, std::uint32_t material_index, bool skinned);

    /// Triangles, their material, texture coordinates and colours. Has no vertices where it has no triangles.
    Mesh still;
    /// Of what was mended in it.
    const GltfWarnings& warnings() const { return warnings_; }
    /// Throws Error where it follows a joint that is not among so many.
    void check_joints(std::size_t joints) const;
    /// Those whose weight is not 0; what of them cannot be had is warned of.
    std::vector<ActiveTarget> active_targets(std::span<const double> weights, GltfWarnings& warnings) const;

    std::size_t vertices() const override { return count_; }
    VertexArrays read() const override;
    std::vector<JointSet> read_joints() const override;
    std::size_t targets() const override { return primitive_.targets.size(); }
    Moved moved_by(std::size_t target) const override;
    MorphTarget read_target(std::size_t target) const override;

  private:
    int attribute(const std::string& name) const;
    int target_attribute(std::size_t target, const std::string& name) const;
    void check_count(int accessor, std::string_view attribute) const;
    template <class V>
    std::vector<V> read_checked(int accessor, const std::string& attribute, bool normalize = false) const;
    template <class V>
    std::vector<V> read_attribute(const std::string& name, bool normalize = false) const {
        return read_checked<V>(attribute(name), name, normalize);
    }
    std::vector<std::uint32_t> read_joint_indices(const std::string& attribute) const;
    void read_triangles();
    void read_uvs(const GltfMaterial* material);
    void read_colors();
    void find_joints();

    const GltfDocument& document_;
    const GltfAccessors accessors_;
    const tinygltf::Primitive& primitive_;
    std::string element_;
    std::size_t first_ = 0;  // of the vertices that triangles use
    std::size_t count_ = 0;
    bool has_normals_;
    bool has_tangents_;
    std::vector<std::uint32_t> highest_joints_;  // of each set
    GltfWarnings warnings_;
};

}  // namespace halflight
