// The object hierarchy as the raster back end walks it: a tree of culling nodes, whose leaves hold *pieces*, what a
// fragment kernel traces. Pure: no OpenGL.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/core/math.h"
#include "engine/rays/packed_bvh.h"
#include "engine/scene/tables.h"

namespace halflight::rays {

/// Children of one node of the packed hierarchies, with all that is below them. Every leaf of the scene is below one
/// culling leaf's first piece.
struct Piece {
    Bounds box;               // world (relative to TraceTables::origin), rounded outwards
    std::uint32_t node = 0;   // index, as in references of shaders/shared/bvh.h
    std::uint32_t slots = 0;  // bit i: child i
};

/// Where pieces live: in the hierarchy at index 0, or in the block of an instance, entered from a node of that
/// hierarchy.
struct Space {
    static constexpr std::uint32_t kWorld = ~0u;
    std::uint32_t instance = kWorld;
    std::uint32_t door = 0;  // top level's node that has the instance for a child
};

/// A leaf has pieces: the first is all of it, the others, if there are any, are the same cut into parts.
struct CullNode {
    Bounds box;  // holds those below
    std::uint32_t parent = 0;
    std::uint32_t first_child = 0;  // children lie side by side
    std::uint32_t child_count = 0;  // 0: a leaf
    std::uint32_t first_piece = 0;
    std::uint32_t piece_count = 0;  // of a leaf: 1, or 3 to shared::kRasterLeafPieces
    std::uint32_t space = 0;        // of a leaf's pieces
};

struct CullTree {
    std::vector<CullNode> nodes;        // the root first, parents before children; empty without a triangle
    std::vector<Piece> pieces;          // the first is the whole scene, of space 0
    std::vector<Space> spaces;          // the first is the world
    std::vector<std::uint32_t> survey;  // nodes that together hold everything: shared::kRasterCandidates at most
    Bounds hull;                        // of the grid at index 0
    float slack = 0;                    // of the hierarchy at index 0
};

struct CutSizes {
    std::size_t piece_triangles = 128;  // are not cut into smaller parts
    std::size_t leaf_triangles = 4096;  // of a culling node that is not divided further, at most
    std::size_t most_pieces = 1 << 18;  // both grow until there are no more
};

CullTree build_cull_tree(const PackedScene& packed, const TraceTables& tables, const CutSizes& sizes = {});

}  // namespace halflight::rays
