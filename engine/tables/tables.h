// The scene's geometry, flattened into the arrays that the GPU reads. This code uses no OpenGL. Arrays that a scene
// does not need stay empty.
//
// Geometry is cut into *blocks*, each with a hierarchy of its own. Meshes that are used exactly once are transformed
// and merged into block 0, whose instance is the identity, so that most scenes need no second level. Every mesh used
// more often is a block of its own, relative to the centre of its bounds. World positions are relative to `origin`,
// which lies where the fine detail is and is subtracted in double. So a scene far from the world's origin keeps float
// precision.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "engine/core/math.h"
#include "engine/scene/scene.h"
#include "shaders/shared/triangle.h"

namespace halflight {

/// Flags in the top byte of SceneTables::triangles[i].w; the low 24 bits are the material.
inline constexpr std::uint32_t kTriangleMaterialMask = 0x00ffffffu;
// Alpha mask or blend, or LightLinks by which some light passes: a hit needs the alpha test.
inline constexpr std::uint32_t kTriangleAlpha = 0x80000000u;
using shared::kTriangleCatcher;
using shared::kTriangleMirrored;
using shared::kTriangleOneSided;
using shared::kTrianglePane;

/// Triangles that share a space and a hierarchy.
struct Block {
    std::uint32_t first_triangle = 0;
    std::uint32_t triangle_count = 0;  // > 0
    Bounds bounds;                     // bounds in block space
    dvec3 origin{0};                   // offset subtracted, in object space; block 0: in world space
};

struct BlockInstance {
    std::uint32_t block = 0;
    glm::mat4x3 block_to_world{1};     // affine, world relative to TraceTables::origin
    glm::mat4x3 world_to_block{1};     // inverse of block_to_world, computed in double
    bool identity = false;             // true for block 0 alone
    std::uint32_t scene_instance = 0;  // index into Scene::instances; unspecified if `identity`
};

/// One mesh in the tables. Table vertex `first_vertex + i` is vertex i of the mesh, and table triangle `first_triangle
/// + j` is its triangle j. Corners are in file order, even if a merged transform mirrors. The barycentrics (u, v) of
/// a hit are therefore weights of the file's second and third corner. Ranges are in ascending order without gaps:
/// merged meshes in the order of Scene::instances, then shared ones in the order of Scene::meshes.
struct MeshRange {
    std::uint32_t mesh = 0;      // index into Scene::meshes
    std::uint32_t instance = 0;  // index into Scene::instances; shared: the mesh's first instance
    bool merged = false;         // true: transformed into block 0; false: in object space minus Block::origin
    bool moves = false;          // changes in block space with the pose of the scene
    std::uint32_t block = 0;
    std::uint32_t first_vertex = 0;
    std::uint32_t vertex_count = 0;
    std::uint32_t first_triangle = 0;
    std::uint32_t triangle_count = 0;  // > 0
    bool operator==(const MeshRange&) const = default;
};

/// The scene's triangle of a hit, for the id outputs.
struct TriangleSource {
    std::uint32_t instance = 0;  // index into Scene::instances
    std::uint32_t triangle = 0;  // index within the mesh of the instance
};

/// Geometry that is not in memory. Only resident triangles, those that emit light and panes, have rows in the tables,
/// with three vertices each.
struct AbsentGeometry {
    std::vector<bool> used_materials;     // per material, whether some triangle has it
    bool vertex_colors = false;           // some vertex colour is not white
    bool tangents = false;                // some mesh has tangents
    std::vector<std::uint32_t> resident;  // triangles of the rows: places in the tables of all geometry, ascending
    std::vector<vec4> attributes;         // vertex attribute rows of these triangles (ShadingTables::vertices)
    bool operator==(const AbsentGeometry&) const = default;
};

struct TraceTables {
    dvec3 origin{0};               // world position of the tables' origin
    Bounds bounds;                 // bounds of all triangles, relative to origin; empty without any
    std::vector<vec3> positions;   // positions in block space; PrepareOptions::scene_read frees them after use
    std::vector<uvec4> triangles;  // xyz: indices into positions (and vertex attributes); w: flags | material
    std::vector<MeshRange> ranges;
    std::vector<Block> blocks;
    std::vector<BlockInstance> instances;  // the identity, if any, then instances in scene order; >= 1 with triangles
    bool alpha_tested = false;  // kernels test alpha: a triangle has kTriangleAlpha or is a pane, or --keep asks
    bool slivers = false;       // kernels test triangles in double: some is_sliver()
    bool catchers = false;      // some triangle has kTriangleCatcher
    bool one_sided = false;     // a triangle has kTriangleOneSided, or --keep asks for tests of back faces
    bool panes = false;         // some triangle is a pane, or panes are kept; alpha_tested is then set, too
    // Set for scenes whose hierarchy is loaded in pages.
    std::optional<AbsentGeometry> absent{};
    bool keep_top_level = false;  // true: a single instance has a hierarchy over instances, too

    /// Returns the number of vertices, also after `positions` were freed.
    std::size_t vertex_count() const {
        return ranges.empty() ? 0 : std::size_t{ranges.back().first_vertex} + ranges.back().vertex_count;
    }
};

/// Returns whether a triangle is a sliver: more than kSliverAspect times as long as it is high. Float rounding would
/// move hits on it by more than some thousandths of its height. A triangle whose height is lost in the rounding of its
/// coordinates (2^-24 of the largest) is no sliver: in float it has no area.
bool is_sliver(const vec3& a, const vec3& b, const vec3& c);
inline constexpr double kSliverAspect = 2000;

/// Returns the tables. Precondition: validate(scene) passes. Meshes used once are merged into block 0. So are instances
/// whose transform is singular, or so ill-conditioned that rays would lose nearly half of their bits in object space,
/// and shadow catchers, whose triangles have a flag.
/// The flag kTriangleAlpha is set only if some alpha decides hits: below 1 (blend) or below the cutoff (mask), or if
/// LightLinks do (passed_classes()).
/// Triangles of materials with is_one_sided() have kTriangleOneSided, and kTriangleMirrored if a merged transform
/// mirrors. Those with is_pane() have kTrianglePane, but for shadow catchers.
/// Throws Error for
///   - an instance beyond 2^40 from the scene's centre (products of three coordinates must be finite in float),
///   - a mesh that refers to material 2^24 or above,
///   - kBvhTriangleLimit triangles or more (about 10^9), or 2^32 vertices or more.
///
/// `flatten_limit` is the number of triangles up to which shared meshes are merged as well. Meshes with the fewest
/// triangles in all their instances go first. A scene without a second level is traced 1.2 to 1.4 times as fast (city
/// of 10^6 triangles). kFlattenLimit triangles take 240 MB of device memory and two seconds.
///
/// `reference` is TraceTables::origin of the scene's reference pose, or none. It is used again if it is good enough,
/// so that meshes that do not move keep their table values. It is good enough if the mean of distance over instance
/// size, taken over all triangles, is at most kNearOrigin or twice the possible minimum. The size of an instance is
/// half the diagonal of its box.
TraceTables build_trace_tables(const Scene& scene, std::size_t flatten_limit = 0,
                               const std::optional<dvec3>& reference = std::nullopt);
inline constexpr double kNearOrigin = 16;
inline constexpr std::size_t kFlattenLimit = std::size_t{1} << 21;

/// Returns the source of a hit on `triangle` through the table instance `instance` (Hit of
/// shaders/shared/ray_structs.h).
TriangleSource source_of(const TraceTables& tables, std::uint32_t instance, std::uint32_t triangle);

}  // namespace halflight
