// Tangent frames for normal maps after Mikkelsen, "Simulation of Wrinkled Surfaces Revisited" (2008), chapter 4. glTF
// 2.0, section 3.7.2.1, calls this standard of baking programs MikkTSpace.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "engine/scene/scene.h"

namespace halflight {

/// Replaces `mesh.tangents`. `uv`: one per vertex, the coordinates at which the normal map is looked up (v downwards).
///
/// Corners of equal position, normal and uv share a frame if their triangles are joined by edges and have the same
/// winding in uv space. Each triangle contributes its direction of growing u, weighted by its angle at the corner. A
/// vertex whose corners have different frames is split, so the mesh may grow. Triangles without area in uv space take
/// their neighbours' frames, or any unit tangent. Vertices that a pose has mirrored have the other handedness, because
/// their normals are against the winding; `sides` are those of VertexExtras (engine/scene/geometry.h).
/// Preconditions: unit normals, no degenerate triangles.
void generate_tangents(Mesh& mesh, const std::vector<vec2>& uv, std::span<const float> sides = {});

}  // namespace halflight
