// The object hierarchy as the raster back end walks it on the CPU. Pure: no OpenGL.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/core/math.h"
#include "engine/rays/packed_bvh.h"

namespace halflight::rays {

/// Some children of one node of the hierarchy at index 0, with all that is below them. Instances are not divided.
struct CullNode {
    Bounds box;  // world (relative to TraceTables::origin), rounded outwards
    std::uint32_t parent = 0;
    std::uint32_t first_child = 0;  // they lie side by side
    std::uint32_t child_count = 0;  // 0: a leaf
    std::uint32_t node = 0;         // index, as in references of shaders/shared/bvh.h
    std::uint32_t slots = 0;        // bit i: child i
};

struct CullTree {
    std::vector<CullNode> nodes;        // the root, the whole scene, first; parents before children; empty without a
                                        // triangle
    std::vector<std::uint32_t> survey;  // nodes that together hold everything, shared::kRasterCandidates at most
    Bounds hull;                        // of the grid at index 0
    float slack = 0;                    // of the hierarchy at index 0
};

struct CutSizes {
    std::size_t leaf_triangles = 16384;  // of a node that is not divided further, at most, where it can be divided
    std::size_t most_nodes = 1 << 16;    // leaf_triangles grows until there are no more
};

CullTree build_cull_tree(const PackedScene& packed, const CutSizes& sizes = {});

}  // namespace halflight::rays
