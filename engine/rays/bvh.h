// Four-wide bounding volume hierarchies, built by Embree. No OpenGL: the layout that kernels read is in packed_bvh.h.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/math.h"
#include "engine/rays/pairs.h"

namespace halflight::rays {

inline constexpr std::uint32_t kMaxLeafPrimitives = 4;

struct BvhChild {
    Bounds bounds;            // holds all boxes below it; empty: there is no such child
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
    std::vector<std::uint32_t> primitives;  // in leaf order, ascending within a leaf; each at least once
    std::uint32_t stack_entries = 0;        // most children that a traversal in any order has put aside at one time
};

/// Surface area heuristic; the result is a function of the input alone. Throw Error when Embree does.
/// One box per primitive, none of them empty. A leaf holds one primitive.
Bvh build_bvh(std::span<const Bounds> boxes);

/// Leaves of at most kMaxLeafPrimitives pairs of triangles. Large pairs may be split between leaves (Stich, Friedrich,
/// Dietrich 2009, Spatial Splits in Bounding Volume Hierarchies), up to kSplitBudget references per pair: each leaf's
/// box then holds a part of the pair, and all of them together hold it all.
inline constexpr double kSplitBudget = 1.5;
enum class Splits : std::uint8_t { allowed, none };
Bvh build_pair_bvh(std::span<const Ring> pairs, Splits splits = Splits::allowed);

}  // namespace halflight::rays
