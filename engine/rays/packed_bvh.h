// Hierarchies and triangles in the layout of kernels (shaders/shared/bvh_nodes.h). No OpenGL is used.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/core/math.h"
#include "engine/rays/hierarchies.h"
#include "engine/tables/tables.h"

namespace halflight::rays {

/// Layout of nodes. `grid` takes 64 bytes per node and is faster. `floating` takes 128 bytes, for scenes whose details
/// are too small for one grid over the whole scene. `page` is for scenes that are loaded in pages
/// (engine/paging/page_pool.h); pack_scene() does not make it.
enum class NodeFormat : std::uint8_t { grid, floating, page };

struct PackedScene {
    NodeFormat format = NodeFormat::grid;
    bool two_level = false;                    // the hierarchy at index 0 is over instances
    std::vector<uvec4> nodes;                  // texels: RGBA32UI, or the bits of RGBA32F
    std::vector<vec4> pairs;                   // texels: RGBA32F, kBvhPairTexels per pair
    std::vector<std::uint32_t> instance_head;  // per instance: node index of its block's head
    std::uint32_t stack_entries = 1;           // maximum stack of a traversal, entries, >= 1
    std::size_t node_count = 0;                // number of nodes without heads
    double build_seconds = 0;                  // seconds of the CPU clock, hierarchies included
    // mean ratio of a box's area on the grid to its exact area; for both formats
    double looseness = 1;
    std::shared_ptr<PackedScene> panes;  // hierarchies over the panes alone; null without panes
};

/// Packs a scene; `hierarchies` must have the pose of the tables. Selects the format by the grid's looseness. Throws
/// Error if indices overflow.
PackedScene pack_scene(const TraceTables& tables, const Hierarchies& hierarchies);
/// Packs a scene, and frees the contents of each hierarchy as soon as they are packed. Large scenes need the memory.
PackedScene pack_scene(const TraceTables& tables, Hierarchies&& hierarchies);
/// Packs a scene with new hierarchies.
PackedScene pack_scene(const TraceTables& tables);
PackedScene pack_scene(const TraceTables& tables, NodeFormat format);
/// Packs hierarchies over the panes alone; null if TraceTables::panes is not set.
std::shared_ptr<PackedScene> pack_panes(const TraceTables& tables);

/// Packs a hierarchy over boxes in the format `grid`. Its leaves refer to places in Bvh::primitives, and there are no
/// pairs: kernels can cull by it, but not trace.
PackedScene pack_boxes(const Bvh& bvh, const Bounds& bounds);

/// Returns the head of a block's hierarchy: two texels.
std::vector<uvec4> packed_head(const Bounds& block);

}  // namespace halflight::rays
