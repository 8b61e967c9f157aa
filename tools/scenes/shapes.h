// Shapes that several scenes use. All take the builder's material and frame.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "tools/scenes/mesh.h"

namespace halflight::scenes {

/// The surface p(u, v), u and v in [0, 1], of columns x rows cells; its front is where dp/du x dp/dv points, its
/// normals are smooth, its uv (u, 1 - v) * repeat. A border row may shrink to a point.
void surface(MeshBuilder& mesh, int columns, int rows, const std::function<dvec3(double, double)>& p,
             const dvec2& repeat = dvec2(1));

/// The surface of revolution about +y of a profile of (radius, height), outside to the right of its direction (upwards:
/// away from the axis). Edges that turn by more than 35 degrees stay sharp. uv: `repeat` times around, height / texel.
void lathe(MeshBuilder& mesh, std::span<const dvec2> profile, int segments, double repeat = 1, double texel = 1);

/// A smooth profile through the points (Catmull-Rom, `steps` pieces between neighbours).
std::vector<dvec2> curve(std::span<const dvec2> points, int steps);

void sphere(MeshBuilder& mesh, const dvec3& centre, double radius, int segments, int rings);

/// A round rod along a path; ends open.
void tube(MeshBuilder& mesh, std::span<const dvec3> path, double radius, int sides);

/// A box whose edges and corners are cut off by `bevel`, so that they catch the light.
void bevelled_box(MeshBuilder& mesh, const dvec3& lower, const dvec3& upper, double bevel);

/// A wall |x| <= half, y0 to y1, at z = 0 facing +z, with a rectangular hole and the reveal behind it down to -depth.
/// Where the hole reaches y1, something else is expected to go on above it.
void pierced_wall(MeshBuilder& mesh, double half, double y0, double y1, const dvec2& low, const dvec2& high,
                  double depth);

/// A geodesic sphere of 20 * 4^levels triangles with a flat normal on each, so that shading and geometry agree.
void faceted_sphere(MeshBuilder& mesh, const dvec3& centre, double radius, int levels);

}  // namespace halflight::scenes
