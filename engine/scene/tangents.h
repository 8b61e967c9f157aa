// Tangent frames for normal maps, as bakers make them: Mikkelsen, "Simulation of Wrinkled Surfaces Revisited" (2008),
// chapter 4, the standard that glTF 2.0 names MikkTSpace (section 3.7.2.1).
#pragma once

#include <cstddef>
#include <vector>

#include "engine/scene/scene.h"

namespace halflight {

/// Replaces `mesh.tangents`. `uv`: one per vertex, as the normal map is looked up (v downwards, as in glTF).
/// Corners of the same position, normal and uv share a frame where their triangles are joined by edges and wind the
/// same way round in uv space; each triangle's direction of growing u counts by its angle at the corner. A vertex whose
/// corners end up with different frames is split, so the mesh may grow. Triangles without area in uv space take over
/// their neighbours' frames, or get any unit tangent.
/// Preconditions: unit normals, no degenerate triangles.
void generate_tangents(Mesh& mesh, const std::vector<vec2>& uv);

}  // namespace halflight
