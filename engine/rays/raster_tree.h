// The object hierarchy for the CPU traversal of raster culling. No OpenGL is used.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/core/math.h"
#include "engine/rays/packed_bvh.h"

namespace halflight::rays {

/// Some children of one node of the hierarchy at index 0, with their subtrees. Instances are not divided.
struct CullNode {
    Bounds box;  // bounds relative to TraceTables::origin, rounded outwards
    std::uint32_t parent = 0;
    std::uint32_t first_child = 0;  // index of the first child; children are consecutive
    std::uint32_t child_count = 0;  // number of children; 0: a leaf
    std::uint32_t node = 0;         // index as in references of shaders/shared/bvh_nodes.h
    std::uint32_t slots = 0;        // bit i is set if child i of `node` belongs to this node
};

struct CullTree {
    // Nodes: the root (the whole scene) first, parents before children; empty without triangles.
    std::vector<CullNode> nodes;
    std::vector<std::uint32_t> survey;  // nodes that together hold the whole scene, at most shared::kRasterCandidates
    Bounds hull;                        // bounds of the grid at index 0
    float slack = 0;                    // slack of the hierarchy at index 0
};

struct CutSizes {
    std::size_t leaf_triangles = 16384;  // maximum triangles of a leaf, except for leaves that cannot be divided
    std::size_t most_nodes = 1 << 16;    // maximum number of nodes; leaf_triangles grows to respect it
};

CullTree build_cull_tree(const PackedScene& packed, const CutSizes& sizes = {});

}  // namespace halflight::rays
