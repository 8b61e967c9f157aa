// The scene flattened into the arrays that the GPU reads. Pure: no OpenGL. What a scene does not have stays empty.
//
// Geometry is cut into *blocks*, each with a hierarchy of its own. All meshes that are used exactly once are
// transformed and merged into block 0 (its instance is the identity), so that most scenes need no second level; every
// mesh used more often is a block of its own, kept relative to the centre of its bounds. World positions are relative
// to `origin` (where the fine detail is, subtracted in double), so that a scene far from the world's origin
// keeps float precision.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "engine/core/math.h"
#include "engine/scene/scene.h"

namespace halflight {

/// Flags in the top byte of SceneTables::triangles[i].w; the low 24 bits are the material.
inline constexpr std::uint32_t kTriangleMaterialMask = 0x00ffffffu;
inline constexpr std::uint32_t kTriangleAlpha = 0x80000000u;  // alpha mask or blend: a hit needs the alpha test

/// Triangles that share one space and one hierarchy.
struct Block {
    std::uint32_t first_triangle = 0;
    std::uint32_t triangle_count = 0;  // > 0
    Bounds bounds;                     // block space
    dvec3 origin{0};  // what was subtracted: object space; world for merged meshes (TraceTables::origin)
};

struct BlockInstance {
    std::uint32_t block = 0;
    glm::mat4x3 block_to_world{1};     // affine, world relative to TraceTables::origin
    glm::mat4x3 world_to_block{1};     // its inverse, computed in double
    bool identity = false;             // true for the block of merged meshes, and only for that
    std::uint32_t scene_instance = 0;  // index into Scene::instances; meaningless where `identity`
};

/// One mesh in the tables: table vertex `first_vertex + i` is vertex i of the mesh and table triangle
/// `first_triangle + j` its triangle j, corners in file order (also where a merged transform mirrors), so that the
/// barycentrics (u, v) of a hit are weights of the file's second and third corner. Ordered by both firsts, no gaps:
/// merged meshes in the order of Scene::instances, then shared ones in the order of Scene::meshes.
struct MeshRange {
    std::uint32_t mesh = 0;      // index into Scene::meshes
    std::uint32_t instance = 0;  // index into Scene::instances; shared: the first one
    bool merged = false;         // transformed by the instance into block 0; else object space less Block::origin
    bool moves = false;          // in block space, from pose to pose of the scene
    std::uint32_t block = 0;
    std::uint32_t first_vertex = 0;
    std::uint32_t vertex_count = 0;
    std::uint32_t first_triangle = 0;
    std::uint32_t triangle_count = 0;  // > 0
    bool operator==(const MeshRange&) const = default;
};

/// Where a hit of the tables comes from, for the id outputs.
struct TriangleSource {
    std::uint32_t instance = 0;  // index into Scene::instances
    std::uint32_t triangle = 0;  // within its mesh
};

struct TraceTables {
    dvec3 origin{0};               // world
    Bounds bounds;                 // of everything, relative to origin; empty without a triangle
    std::vector<vec3> positions;   // block space
    std::vector<uvec4> triangles;  // xyz: indices into positions (and vertex attributes); w: flags | material
    std::vector<MeshRange> ranges;
    std::vector<Block> blocks;
    std::vector<BlockInstance> instances;  // at least one where there is a triangle; identity first, then scene order
    bool alpha_tested = false;    // whether kernels test alpha: some triangle has kTriangleAlpha, or it is kept
    bool slivers = false;         // whether kernels test triangles in double: some is_sliver()
    bool keep_top_level = false;  // a hierarchy over instances, even if one of them is all there is
};

/// Whether a triangle is a needle: more than kSliverAspect times as long as it is high. Floats then place what a ray
/// meets by more than some thousandths of its height wrongly. None is one whose height is lost in the rounding of its
/// coordinates (2^-24 of the largest): it has no area as far as floats can tell.
bool is_sliver(const vec3& a, const vec3& b, const vec3& c);
inline constexpr double kSliverAspect = 2000;

/// Precondition: validate(scene) passes. A mesh used once is merged into block 0, and so is each instance whose
/// transform is singular, or so ill-conditioned that rays brought to object space would lose nearly half of their
/// bits. kTriangleAlpha is set only where alpha can decide a hit: not where every alpha is 1 or no alpha is below the
/// cutoff. Throws Error where an instance reaches beyond 2^40 from the scene's centre (products of three coordinates
/// must stay finite in float), where a mesh names 2^24 materials or more, or where there are 2^28 triangles or more.
///
/// flatten_limit: shared meshes are merged as well, those with the fewest triangles in all their instances first, as
/// long as these come to no more than `flatten_limit` triangles. A scene without a second level is traced 1.2 to 1.4
/// times as fast (a city of 10^6 triangles); of kFlattenLimit triangles it takes 240 MB of device memory and two
/// seconds.
///
/// reference: TraceTables::origin of the scene's reference pose. It is taken again wherever that is good enough, so
/// that what does not move keeps its places: where the mean over all triangles of distance from it over size of their
/// instance (half the diagonal of its box) is kNearOrigin at most, or no more than twice what it could be.
TraceTables build_trace_tables(const Scene& scene, std::size_t flatten_limit = 0,
                               const std::optional<dvec3>& reference = std::nullopt);
inline constexpr double kNearOrigin = 16;
inline constexpr std::size_t kFlattenLimit = std::size_t{1} << 21;

/// The source of triangle `triangle` hit through table instance `instance` (Hit of shaders/shared/rays.h).
TriangleSource source_of(const TraceTables& tables, std::uint32_t instance, std::uint32_t triangle);

}  // namespace halflight
