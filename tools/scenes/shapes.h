// Shapes that several scenes use. All take the builder's material and frame.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "tools/scenes/mesh.h"

namespace halflight::scenes {

/// Returns (cos, sin) of `sides` equal angles from 0 on, and the first one again. Not thread-safe.
const std::vector<dvec2>& ring_of(int sides);

/// Adds the surface p(u, v), u and v in [0, 1], of columns x rows cells. Its front is in the direction of dp/du x
/// dp/dv, its normals are smooth, its uv is (u, 1 - v) * repeat. A border row may shrink to a point.
void surface(MeshBuilder& mesh, int columns, int rows, const std::function<dvec3(double, double)>& p,
             const dvec2& repeat = dvec2(1));

/// Adds the surface of revolution about +y of a profile of (radius, height). Its outside is to the right of the
/// profile's direction: away from the axis where it goes up. Edges of more than 35 degrees stay sharp. uv: `repeat`
/// times around, height / texel.
void lathe(MeshBuilder& mesh, std::span<const dvec2> profile, int segments, double repeat = 1, double texel = 1);

/// Returns a smooth profile through the points (Catmull-Rom, `steps` pieces between neighbours).
std::vector<dvec2> curve(std::span<const dvec2> points, int steps);

void sphere(MeshBuilder& mesh, const dvec3& centre, double radius, int segments, int rings);

/// Adds a round rod with open ends along a path.
void tube(MeshBuilder& mesh, std::span<const dvec3> path, double radius, int sides);

/// Adds a box whose edges and corners are cut off by `bevel`, so that they catch the light.
void bevelled_box(MeshBuilder& mesh, const dvec3& lower, const dvec3& upper, double bevel);

/// Adds a wall |x| <= half, y0 to y1, at z = 0 facing +z, with a rectangular hole and the reveal behind it down to
/// -depth. A hole that reaches y1 stays open at the top.
void pierced_wall(MeshBuilder& mesh, double half, double y0, double y1, const dvec2& low, const dvec2& high,
                  double depth);

/// Adds a geodesic sphere of 20 * 4^levels triangles with flat normals, so that shading and geometry agree.
void faceted_sphere(MeshBuilder& mesh, const dvec3& centre, double radius, int levels);

}  // namespace halflight::scenes
