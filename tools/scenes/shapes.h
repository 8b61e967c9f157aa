// Shapes that several scenes use.
#pragma once

#include <functional>
#include <span>

#include "tools/scenes/mesh.h"

namespace halflight::scenes {

/// A geodesic sphere of 20 * 4^levels triangles with a flat normal on each, so that shading and geometry agree.
void faceted_sphere(MeshBuilder& mesh, const dvec3& centre, double radius, int levels);

}  // namespace halflight::scenes
