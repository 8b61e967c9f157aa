// Mending triangle meshes: what the world sends is brought to what scene.h promises of a Mesh.
#pragma once

#include <cstddef>
#include <span>

#include "engine/scene/scene.h"

namespace halflight {

/// Twice the area vector of a triangle, in double: (p1 - p0) x (p2 - p0). Zero means: dropped as degenerate. In double
/// the products of float differences neither overflow nor vanish.
dvec3 area_vector(const Mesh& mesh, const uvec3& triangle);

/// Makes vertex i of `mesh` a copy of its former vertex sources[i], in every per-vertex array. Triangles are untouched.
void gather_vertices(Mesh& mesh, std::span<const std::uint32_t> sources);

/// What drop_bad_triangles() took away.
struct DroppedTriangles {
    std::size_t non_finite = 0;  // a corner's position is NaN or infinite
    std::size_t degenerate = 0;  // area_vector() is exactly zero
};

/// Removes the triangles that cannot be rendered, and the vertices that no triangle uses. Order is kept.
/// Precondition: triangle indices are in range.
DroppedTriangles drop_bad_triangles(Mesh& mesh);

/// One flat normal per triangle (glTF 2.0, section 3.7.2.1); vertices are no longer shared. Returns their number.
/// Precondition: no degenerate triangles.
std::size_t generate_flat_normals(Mesh& mesh);

/// Normalises all normals. Those that are zero or not finite become the area-weighted mean of the triangles around
/// them. Returns the number of the latter. Precondition: no degenerate triangles, every vertex is used, a normal each.
std::size_t repair_normals(Mesh& mesh);

/// Appends `part` to `mesh`. An array that only one of them has is filled up for the other: uvs with 0, colours with 1,
/// tangents with any unit tangent. Throws Error where vertices would outnumber 32-bit indices.
void append(Mesh& mesh, const Mesh& part);

/// A unit vector perpendicular to `n` (unit).
vec3 any_perpendicular(const vec3& n);

}  // namespace halflight
