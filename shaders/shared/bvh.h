// Layout of the hierarchies in UNIT_NODES and of the triangles in UNIT_TRIANGLE_VERTICES. One copy for C++ and GLSL.
//
// Nodes are four wide. Their bounds come in one of two formats, the same for all hierarchies of a scene:
//   grid   RGBA32UI, 4 texels. 16-bit cells of a grid over the hierarchy's space. Texel 0 to 2 is an axis:
//          (lower of children 0 | 1 << 16, of 2 | 3 << 16, upper of 0 | 1 << 16, of 2 | 3 << 16). Texel 3: references.
//   float  RGBA32F, 8 texels. Texel 2a is the lower bound of the four children along axis a, 2a + 1 the upper one.
//          Texel 6: references. Texel 7 is padding.
// A hierarchy begins with a head that takes the place of a node: texel 0 (base.xyz, slack), texel 1 (cell.xyz, 0), as
// floats. The grid is base + cell * [0, kGridCells]; both formats are inside of it. Node 1 after the head is the root.
// The head of the hierarchy where traversal begins is at index 0.
//
// Triangles come in pairs with a common edge, of 4 texels. Texel 0 to 2 is an axis: that coordinate of the corners of a
// ring, of which 0, 1, 2 are the first triangle's and 2, 3, 0 the second's. Texel 3: (id of the first, of the second,
// orders, 0), the first id being the lower one. A triangle alone is paired with itself: corners 1 and 3 are the same.
// The orders, 4 bits for each triangle, say where the file's second corner (2 bits) and third one (2 bits) are: 0 and 1
// are the ring's corners 0 and 2, 2 is the corner that the other triangle does not have.
//
// References, ids and orders are 32-bit words with kBvhTag set and bit 31 not, so that they are also normal floats,
// which no texture unit flushes or quiets.
#ifndef HALFLIGHT_SHARED_BVH_H
#define HALFLIGHT_SHARED_BVH_H

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST uint kBvhTag = 0x40000000u;

// References: inner nodes (no flag) < leaves < instances < what only a traversal's stack holds.
HALFLIGHT_SHARED_CONST uint kBvhLeaf = 0x10000000u;       // flag: `count` pairs; 0: there is no such child
HALFLIGHT_SHARED_CONST uint kBvhInstance = 0x20000000u;   // flag: leaf of the top level
HALFLIGHT_SHARED_CONST int kBvhCountShift = 25;           // leaf: 3 bits
HALFLIGHT_SHARED_CONST uint kBvhIndexMask = 0x01ffffffu;  // node, first pair of a leaf, or instance
HALFLIGHT_SHARED_CONST uint kBvhNoChild = 0x50000000u;    // kBvhTag | kBvhLeaf

HALFLIGHT_SHARED_FUNCTION bool is_inner_node(uint reference) {
    return reference < (kBvhTag | kBvhLeaf);
}
HALFLIGHT_SHARED_FUNCTION bool is_leaf(uint reference) {
    return (reference & (kBvhLeaf | kBvhInstance)) == kBvhLeaf;
}

// Ids of triangles.
HALFLIGHT_SHARED_CONST uint kBvhAlphaTested = 0x10000000u;   // flag
HALFLIGHT_SHARED_CONST uint kBvhTriangleMask = 0x0fffffffu;  // index into TraceTables::triangles

HALFLIGHT_SHARED_CONST int kBvhOrderShift = 4;  // to the order of a pair's second triangle
HALFLIGHT_SHARED_CONST int kBvhPairTexels = 4;

HALFLIGHT_SHARED_CONST int kBvhGridTexels = 4;   // per node
HALFLIGHT_SHARED_CONST int kBvhFloatTexels = 8;  // per node
HALFLIGHT_SHARED_CONST float kGridCells = 65535.0f;

HALFLIGHT_SHARED_END

#endif
