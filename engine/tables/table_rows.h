// Rows of the tables, mesh by mesh. build_trace_tables() and build_shading_tables() collect them in memory, and
// engine/paging streams them to files. This code uses no OpenGL.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/scene/material_properties.h"
#include "engine/scene/scene.h"
#include "engine/tables/needs.h"
#include "engine/tables/tables.h"

namespace halflight {

// --- Trace tables ----------------------------------------------------------------------------------------------------

/// Size of a mesh, on which the choice of the origin depends.
struct MeshExtent {
    Bounds box;                 // bounds of all vertices
    std::size_t triangles = 0;  // number of triangles; without any, the mesh does not count
};
MeshExtent extent_of(const Mesh& mesh);

/// Chooses TraceTables::origin. Float rounding of a position grows with its distance from the origin and matters in
/// proportion to the size of the object. So the origin minimises the sum, over all triangles, of distance over size of
/// their instance. On each axis this is a weighted median of the instances' centres. `meshes` has the extents of the
/// meshes, and `reference` is that of build_trace_tables().
dvec3 choose_origin(std::span<const Instance> instances, std::span<const MeshExtent> meshes,
                    const std::optional<dvec3>& reference = std::nullopt);

/// Returns whether the transform of an instance mirrors.
bool mirrors(const Instance& instance);
/// Returns the word of a triangle as a merged transform places it.
inline std::uint32_t placed_word(std::uint32_t word, bool mirrored) {
    return mirrored && (word & kTriangleOneSided) != 0 ? word | kTriangleMirrored : word;
}

/// Flags and materials of triangles: the word w of TraceTables::triangles.
class TriangleWords {
  public:
    /// Reads the alpha of images that can decide a hit. The scene must outlive the object. Throws Error for more than
    /// 2^24 materials.
    explicit TriangleWords(const Scene& scene);
    /// Returns the words of a mesh's triangles, by material. `vertex_alpha` is lowest_vertex_alpha().
    std::vector<std::uint32_t> of(float vertex_alpha) const;
    std::uint32_t of(std::uint32_t material, float vertex_alpha) const;  ///< Returns the word for one material.
    static float lowest_vertex_alpha(const Mesh& mesh);
    /// Returns a hash of what the images of the scene say about alpha tests. It is the same in all poses.
    std::uint64_t alpha_tests() const;

  private:
    const Scene& scene_;
    std::vector<float> image_alpha_;  // lowest alpha of each image that can decide a hit
};

inline constexpr double kSceneReach = 0x1p40;  // limit of positions relative to the tables' origin, world units
[[noreturn]] void fail_beyond_reach(const Scene& scene, std::size_t instance);
/// Throws Error if a position, relative to the tables' origin, is beyond the limit of build_trace_tables().
inline void check_reach(const dvec3& placed, const Scene& scene, std::size_t instance) {
    if (!glm::all(glm::lessThan(glm::abs(placed), dvec3(kSceneReach)))) fail_beyond_reach(scene, instance);
}

/// Throws Error if tables would be larger than the limits of build_trace_tables().
void check_table_size(const Scene& scene, std::size_t vertices, std::size_t triangles);

/// Returns the position of a vertex of a merged instance, relative to the tables' origin, before rounding.
inline dvec3 merged_position(const Instance& instance, const vec3& position, const dvec3& origin) {
    return dvec3(instance.object_to_world * dvec4(dvec3(position), 1)) - origin;
}

// --- Shading tables --------------------------------------------------------------------------------------------------

/// Vertex attributes on which the layout of attribute rows depends.
struct VertexAttributes {
    bool colors = false;    // some vertex colour is not white
    bool tangents = false;  // some mesh has tangents

    void add(const Mesh& mesh);
};

/// Returns whether a material looks a texture up.
bool looks_up(const Material& material, const MaterialTexture& texture, const VertexAttributes& attributes);

/// Returns whether a material has a lobe.
bool has_lobe(const Material& material, const MaterialLobe& lobe, const VertexAttributes& attributes);

/// Returns the needs that decide about the layout of attribute rows. used: per material, whether triangles have it.
SceneNeeds layout_needs(std::span<const Material> materials, const std::vector<bool>& used,
                        const VertexAttributes& attributes);

/// Transform of normals and tangents of a merged mesh to world space. The largest coefficient of each matrix is scaled
/// to 1, so that products do not overflow and all vertices of a mesh keep equal weight.
struct VertexTransform {
    dmat3 normal{1};
    dmat3 tangent{1};
    float handedness = 1;  // sign of the determinant

    VertexTransform() = default;
    explicit VertexTransform(const dmat4& object_to_world);
};

/// Writes the attribute rows of all vertices of a mesh (shaders/shared/vertex.h), SceneNeeds::vertex_stride() texels
/// each.
void write_vertex_rows(const Mesh& mesh, const VertexTransform& transform, const SceneNeeds& needs, vec4* rows);

}  // namespace halflight
