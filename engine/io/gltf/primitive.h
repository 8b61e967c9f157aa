// Primitives as triangles, before a pose moves their vertices.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/io/gltf/accessor.h"
#include "engine/io/gltf/draco.h"
#include "engine/io/gltf/material.h"
#include "engine/io/gltf/strokes.h"
#include "engine/scene/deformer.h"

namespace halflight {

/// TextureRef::uv_set of GltfPrimitive::tangent_uvs.
inline constexpr int kTangentUvs = 2;

/// Returns the texture whose coordinates tangents follow: the normal map, else the texture of the anisotropy, else no
/// image with TEXCOORD_0, or kTangentUvs if textures use two other sets. Returns none if the material needs no
/// tangents or is null.
std::optional<TextureRef> tangent_texture_of(const GltfMaterial* material);

class GltfPrimitive final : public RestShape {
  public:
    /// Reads the data that no pose changes. `material` is null for the default material; `material_index` is the index
    /// in either case. `skinned` tells whether JOINTS_n and WEIGHTS_n give the joints of vertices. `radius` is that of
    /// points and lines, which become triangles. The document must outlive the object. Throws Error for indices out of
    /// range, attributes of different lengths, damaged accessors, and missing joints of a skinned mesh.
    GltfPrimitive(const GltfDocument& document, const tinygltf::Primitive& primitive, std::string element,
                  const GltfMaterial* material, std::uint32_t material_index, bool skinned, float radius = 0);

    /// Triangles, their material, texture coordinates and colours; no vertices without triangles.
    Mesh still;
    /// TEXCOORD_0 if tangents follow it and `still` has two other sets; otherwise empty.
    std::vector<vec2> tangent_uvs;
    /// Returns the warnings about repairs.
    const GltfWarnings& warnings() const { return warnings_; }
    /// Throws Error if a vertex follows a joint with an index >= `joints`. Warns of such joints without weight.
    void check_joints(std::size_t joints, GltfWarnings& warnings) const;
    /// Returns the targets with a weight other than 0; warns of unsupported parts.
    std::vector<ActiveTarget> active_targets(std::span<const double> weights, GltfWarnings& warnings) const;

    /// Returns the number of points or segments of lines.
    std::size_t strokes() const { return stroke_count_; }

    std::size_t vertices() const override { return strokes_ ? strokes_->sources.size() : count_; }
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
    /// Returns the values of the vertices around which strokes lie, `size` consecutive ones per vertex.
    template <class V>
    std::vector<V> around(std::vector<V> values, std::size_t size = 1) const;
    template <class V>
    std::vector<V> read_attribute(const std::string& name, bool normalize = false) const {
        return read_checked<V>(attribute(name), name, normalize);
    }
    /// Returns JOINTS_n and WEIGHTS_n. Joints without weight are 0; the highest index of these is added to `ignored`.
    JointSet read_joint_set(std::size_t set, std::uint32_t* ignored = nullptr) const;
    void read_triangles();
    void read_strokes(const std::vector<std::uint32_t>& indices, int mode);
    void read_uvs(const GltfMaterial* material);
    std::vector<vec2> read_uv_set(int set);
    void read_colors();
    void find_joints();
    void free_decoded();

    const GltfDocument& document_;
    const tinygltf::Primitive& primitive_;
    std::string element_;
    std::optional<GltfDracoMesh> draco_;  // after construction, what poses read
    const GltfAccessors accessors_;
    std::size_t first_ = 0;  // first vertex used by triangles
    std::size_t count_ = 0;
    float radius_;
    std::optional<Strokes> strokes_;  // points or lines; their triangles are in `still`
    std::size_t stroke_count_ = 0;
    bool has_normals_;
    bool has_tangents_;
    std::vector<std::uint32_t> highest_joints_;  // highest joint of each set with a weight
    std::uint32_t ignored_joint_ = 0;            // highest joint without weight
    GltfWarnings warnings_;
};

}  // namespace halflight
