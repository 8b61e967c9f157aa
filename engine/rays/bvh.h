// Four-wide bounding volume hierarchies, built by Embree. No OpenGL: the layout that kernels read is in packed_bvh.h.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/math.h"

namespace halflight::rays {

inline constexpr std::uint32_t kMaxLeafPrimitives = 4;

struct BvhChild {
    Bounds bounds;            // exact union of what is below; empty: there is no such child
    std::uint32_t first = 0;  // leaf: first entry in Bvh::primitives; inner node: index into Bvh::nodes
    std::uint32_t count = 0;  // leaf: 1 to kMaxLeafPrimitives; 0: inner node

    bool leaf() const { return count != 0; }
};

struct BvhNode {
    std::array<BvhChild, 4> children;  // those that exist come first
    int child_count() const;
};

struct Bvh {
    std::vector<BvhNode> nodes;             // depth first, the root first; empty without a primitive
    std::vector<std::uint32_t> primitives;  // every primitive once, in leaf order; ascending within a leaf
    std::uint32_t stack_entries = 0;        // most children that a traversal in any order has put aside at one time
};

/// One box per primitive; empty boxes are not allowed. Surface area heuristic, leaves of at most `max_leaf` primitives.
/// The result is a function of the boxes alone, whatever the number of threads. Throws Error when Embree does.
Bvh build_bvh(std::span<const Bounds> boxes, std::uint32_t max_leaf = kMaxLeafPrimitives);

}  // namespace halflight::rays
