// Nodes and pairs of pages (shaders/shared/bvh_nodes.h). No OpenGL is used.
#pragma once

#include <array>
#include <cstdint>

#include "engine/core/math.h"
#include "engine/rays/bvh.h"
#include "shaders/shared/bvh_nodes.h"

namespace halflight::rays {

using PageNode = std::array<uvec4, shared::kBvhPageTexels>;

/// Encodes a node, with distance 0. What is below a node lies in the order of its children, first the nodes, then the
/// pairs of leaves. Decoded boxes contain the boxes of the children, exactly in float arithmetic.
PageNode encode_page_node(const BvhNode& node);

/// Child of a node of a page.
struct PageChild {
    bool exists = false;
    std::uint32_t offset = 0;  // texels from the first one below the node
    std::uint32_t pairs = 0;   // pairs of a leaf; 0: a node
};
PageChild page_child(const PageNode& node, int child);

/// Returns the distance of a node: from its texel to the first one below it.
inline std::uint32_t& distance_of(PageNode& node) {
    return node[2].z;
}

/// Returns the box of a child as kernels decode it. An empty box may have any lower end above its upper end.
Bounds decode_page_box(const PageNode& node, int child);

}  // namespace halflight::rays
