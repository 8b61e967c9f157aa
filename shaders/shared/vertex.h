// Vertex attribute rows (kUnitVertices, RGBA32F): HALFLIGHT_VERTEX_STRIDE texels per vertex of TraceTables::positions.
//
//   texel 0   normal.xyz, u of uv set 0
//   texel 1   v of uv set 0, u and v of uv set 1, handedness of the tangent (+-1)   with HALFLIGHT_TEXTURES
//   texel 2   tangent.xyz (0: none), 0                                              with HALFLIGHT_NORMAL_MAPS
//   last      colour, linear RGBA                                                   with HALFLIGHT_VERTEX_COLORS
//
// Merged meshes are in world space, shared ones in block space. Normals are transformed by the inverse transpose, and
// tangents by the matrix. Neither is normalized, only scaled by one factor per mesh, because SHADING.md interpolates
// first. The handedness includes the sign of a merged instance's determinant.
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST int kVertexNormalTexel = 0;
HALFLIGHT_SHARED_CONST int kVertexUvTexel = 1;
HALFLIGHT_SHARED_CONST int kVertexTangentTexel = 2;

HALFLIGHT_SHARED_END
