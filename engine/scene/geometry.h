// Repairs of triangle meshes, so that they meet the requirements that scene.h states for Mesh.
#pragma once

#include <cstddef>
#include <span>

#include "engine/scene/scene.h"

namespace halflight {

/// Returns twice the area vector of a triangle, (p1 - p0) x (p2 - p0). Triangles for which it is zero are degenerate.
/// In double the products of float differences neither overflow nor vanish.
dvec3 area_vector(const Mesh& mesh, const uvec3& triangle);

/// Returns whether surfaces keep an area under a transform; a scale of 0 leaves none.
bool leaves_area(const dmat4& object_to_world);
/// Returns whether an instance has a surface: triangles, and a transform that leaves them an area.
bool has_surface(const Scene& scene, const Instance& instance);

/// Makes vertex i of `mesh` a copy of its former vertex sources[i], in every per-vertex array. Triangles are untouched.
void gather_vertices(Mesh& mesh, std::span<const std::uint32_t> sources);

/// Arrays per vertex that only the making of a mesh needs. Each may be empty.
struct VertexExtras {
    std::vector<float> sides;  // -1 if a pose has mirrored the vertex, so that its normal is against the winding of
                               // its triangles; otherwise 1
    std::vector<vec2> uvs;     // texture coordinates that tangents alone follow
};

/// Numbers of triangles that drop_bad_triangles() removed.
struct DroppedTriangles {
    std::size_t non_finite = 0;  // triangles with a corner at NaN or infinity
    std::size_t degenerate = 0;  // triangles whose area_vector() is exactly zero
};

/// Removes the triangles that cannot be rendered, and the vertices that no triangle uses. Order is kept.
/// Precondition: triangle indices are in range.
DroppedTriangles drop_bad_triangles(Mesh& mesh, VertexExtras* extras = nullptr);

/// Gives each triangle a flat normal (glTF 2.0, section 3.7.2.1) and vertices of its own. The side of most corners is
/// that of the triangle. Returns the number of vertices. Precondition: no degenerate triangles.
std::size_t generate_flat_normals(Mesh& mesh, VertexExtras* extras = nullptr);

/// Normalises all normals. Normals that are zero or not finite become the area-weighted mean of the triangles around
/// them; returns their number. `sides` are those of VertexExtras.
/// Precondition: no degenerate triangles, every vertex is used and has a normal.
std::size_t repair_normals(Mesh& mesh, std::span<const float> sides = {});

/// Makes room for so many vertices and triangles in the arrays that `mesh` has.
void reserve(Mesh& mesh, std::size_t vertices, std::size_t triangles);

/// Appends `part` to `mesh`. An array that only one of them has is filled for the other: uvs with 0, colours with 1,
/// tangents with any unit tangent. Throws Error if 32-bit indices cannot address all vertices.
void append(Mesh& mesh, const Mesh& part);

/// Returns a unit vector perpendicular to the unit vector `n`.
vec3 any_perpendicular(const vec3& n);

}  // namespace halflight
