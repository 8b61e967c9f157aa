// Hierarchies and triangles in the layout that kernels read: shaders/shared/bvh.h. Pure: no OpenGL.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/core/math.h"
#include "engine/rays/hierarchies.h"
#include "engine/tables/tables.h"

namespace halflight::rays {

/// grid: 64 bytes a node, faster. floating: 128 bytes, for scenes whose details are too small for a grid over the
/// whole.
enum class NodeFormat : std::uint8_t { grid, floating };

struct PackedScene {
    NodeFormat format = NodeFormat::grid;
    bool two_level = false;                    // the hierarchy at index 0 is one over instances
    std::vector<uvec4> nodes;                  // RGBA32UI, or the bits of RGBA32F
    std::vector<vec4> pairs;                   // RGBA32F, kBvhPairTexels each
    std::vector<std::uint32_t> instance_head;  // per instance: node index of its block's head
    std::uint32_t stack_entries = 1;           // that a traversal needs, >= 1
    std::size_t node_count = 0;                // without heads
    double build_seconds = 0;                  // CPU clock, hierarchies included
    double looseness = 1;                      // mean area of a box on the grid by its exact area; both formats
};

/// hierarchies: of the tables' pose. Chooses the format by the grid's looseness. Throws Error where indices run out.
PackedScene pack_scene(const TraceTables& tables, const Hierarchies& hierarchies);
/// With hierarchies made for it.
PackedScene pack_scene(const TraceTables& tables);
PackedScene pack_scene(const TraceTables& tables, NodeFormat format);

}  // namespace halflight::rays
