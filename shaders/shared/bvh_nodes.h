// Layout of the hierarchies in kUnitNodes and of the triangles in kUnitTriangleVertices, one copy for C++ and GLSL.
//
// Nodes are four wide. Their bounds have one of three formats, equal for all hierarchies of a scene:
//   grid   RGBA32UI, 4 texels. 16-bit cells of a grid over the hierarchy's space. Texel 0 to 2 is an axis:
//          (lower of children 0 | 1 << 16, of 2 | 3 << 16, upper of 0 | 1 << 16, of 2 | 3 << 16). Texel 3: references.
//   float  RGBA32UI, 8 texels of floats. Texel 2a holds the lower bounds of the children along axis a, 2a + 1 the
//          upper ones. Texel 6: references. Texel 7 is padding.
//   page   RGBA32UI, 3 texels, in scenes whose hierarchy is loaded in pages; see below.
// A hierarchy starts with a head in place of a node: texel 0 (base.xyz, slack), texel 1 (cell.xyz, 0), as floats. The
// grid is base + cell * [0, kGridCells]; both formats are inside it. Node 1 after the head is the root. The head of the
// hierarchy where traversal starts is at index 0.
//
// Triangles are stored in pairs with a common edge, of 4 texels. Texel 0 to 2 is an axis: that coordinate of the
// corners of a ring. Its corners 0, 1, 2 are the first triangle's, and 2, 3, 0 are the second's. Texel 3: (id of the
// first, of the second, orders, 0); the first id is the lower one. A single triangle is paired with itself: corners 1
// and 3 are equal. The orders have 4 bits per triangle: the places of the file's second corner (2 bits) and third
// corner (2 bits). Places 0 and 1 are the ring's corners 0 and 2; place 2 is the corner that the other triangle lacks.
// The word of orders also has flags for each triangle: whether it needs the alpha test, whether it has
// kTriangleOneSided and whether it has kTriangleMirrored.
//
// References, ids and orders are 32-bit words with kBvhTag set and bit 31 clear. Ids are below kBvhTriangleLimit.
// Therefore the words are also normal floats, which no texture unit flushes or quiets.
//
// Scenes that are loaded in pages have nodes, pairs and vertices in one buffer: as RGBA32UI in kUnitNodes, and as
// RGB32F in kUnitTriangleVertices. A slot of the buffer holds a page: nodes and pairs first, then the vertices. Slots
// take whole texels of both formats. The hierarchy over all pages follows the slots: its head, then its root.
//   node   3 texels. Texel 0: base.xyz as floats, exponents of the cell's sides (8 bits per axis, as in floats).
//          Texel 1: bounds of the four children in cells, 8 bits each (x lower, x upper, y lower, y upper).
//          Texel 2: (z lower, z upper, distance, children). A bound is base + cells * side, in float arithmetic.
//          `distance` leads from the node's texel to what is below it: the nodes of its children, then the pairs of its
//          leaves. `children` has 8 bits per child: how many texels after that it starts (5 bits), and its pairs (3
//          bits; 0: a node). 31 stands for no child.
//   pair   1 texel: (id of the first triangle, of the second, corners 0 and 1, corners 2 and 3). Corners are texels
//          after the slot's first one in RGB32F, 14 bits each. Above them are the orders of the first and of the second
//          triangle. Ids have kBvhPageAlpha set if the triangle needs the alpha test.
//          Both triangles have the same kTriangleOneSided and kTriangleMirrored. The first id has kBvhPageFacing set
//          for the former, the second one for the latter.
// Distances and corners do not depend on the slot. References to nodes and pairs are their texels; those to leaves also
// have the number of pairs, shifted by kBvhPageCountShift.
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST uint kBvhTag = 0x40000000u;

// References: inner nodes (no flag) < leaves < instances < entries that occur only on a traversal's stack.
HALFLIGHT_SHARED_CONST uint kBvhLeaf = 0x10000000u;       // flag: `count` pairs; 0: no child
HALFLIGHT_SHARED_CONST uint kBvhInstance = 0x20000000u;   // flag: leaf of the top level
HALFLIGHT_SHARED_CONST int kBvhCountShift = 25;           // shift of a leaf's count, 3 bits
HALFLIGHT_SHARED_CONST uint kBvhIndexMask = 0x01ffffffu;  // index of a node, a leaf's first pair or an instance
HALFLIGHT_SHARED_CONST uint kBvhNoChild = 0x50000000u;    // kBvhTag | kBvhLeaf

HALFLIGHT_SHARED_FUNCTION bool is_inner_node(uint reference) {
    return reference < (kBvhTag | kBvhLeaf);
}
HALFLIGHT_SHARED_FUNCTION bool is_leaf(uint reference) {
    return (reference & (kBvhLeaf | kBvhInstance)) == kBvhLeaf;
}

// Ids of triangles.
HALFLIGHT_SHARED_CONST uint kBvhTriangleMask = 0x3fffffffu;  // index into TraceTables::triangles
HALFLIGHT_SHARED_CONST uint kBvhTriangleLimit =
    0x3f800000u;  // ids are lower: above it, words would be no finite floats

HALFLIGHT_SHARED_CONST int kBvhOrderShift = 4;         // shift of the order of a pair's second triangle
HALFLIGHT_SHARED_CONST uint kBvhAlphaTested = 0x100u;  // orders: the first triangle needs the alpha test
HALFLIGHT_SHARED_CONST uint kBvhOneSided = 0x400u;     // orders: the first triangle has kTriangleOneSided
HALFLIGHT_SHARED_CONST uint kBvhMirrored = 0x1000u;    // orders: the first triangle has kTriangleMirrored
HALFLIGHT_SHARED_CONST int kBvhFlagShift = 1;          // shift of these flags for the second triangle
HALFLIGHT_SHARED_CONST int kBvhPairTexels = 4;

HALFLIGHT_SHARED_CONST int kBvhGridTexels = 4;   // texels per node
HALFLIGHT_SHARED_CONST int kBvhFloatTexels = 8;  // texels per node
HALFLIGHT_SHARED_CONST int kBvhPageTexels = 3;   // texels per node

// Scenes that are loaded in pages. References: nodes < leaves < missing pages < no place.
HALFLIGHT_SHARED_CONST int kBvhPageCountShift = 27;
HALFLIGHT_SHARED_CONST uint kBvhPageIndexMask = 0x07ffffffu;  // texel of a node or of a leaf's first pair
HALFLIGHT_SHARED_CONST uint kBvhPageMissing = 0x40000000u;    // | root of the subtree whose page is missing
HALFLIGHT_SHARED_CONST uint kBvhPageNoPlace = 0x7fffffffu;    // a leaf without pairs
HALFLIGHT_SHARED_CONST uint kBvhPageNoChild = 31u;            // code of a node that has no such child
HALFLIGHT_SHARED_CONST int kBvhPageOffsetBits = 5;            // bits of a code that are below the number of pairs
HALFLIGHT_SHARED_CONST int kBvhPageCornerBits = 14;
HALFLIGHT_SHARED_CONST uint kBvhPageCornerMask = 0x3fffu;
HALFLIGHT_SHARED_CONST int kBvhPageOrderShift = 28;
HALFLIGHT_SHARED_CONST uint kBvhPageAlpha = 0x40000000u;
HALFLIGHT_SHARED_CONST uint kBvhPageFacing = 0x80000000u;
// Orders (4 bits) by which the corners of the first, second and third place are in the file's order, as a set of bits.
HALFLIGHT_SHARED_CONST uint kBvhEvenOrders = 0x214u;
HALFLIGHT_SHARED_CONST float kGridCells = 65535.0f;

HALFLIGHT_SHARED_END
