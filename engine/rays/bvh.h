// Four-wide bounding volume hierarchies, built by Embree. No OpenGL is used; packed_bvh.h has the layout for kernels.
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
    Bounds bounds;            // bounds of all boxes below the child; empty: no child
    std::uint32_t first = 0;  // leaf: first entry in Bvh::primitives; inner node: index into Bvh::nodes
    std::uint32_t count = 0;  // primitives of a leaf, 1 to kMaxLeafPrimitives; 0: inner node

    bool leaf() const { return count != 0; }
};

struct BvhNode {
    std::array<BvhChild, 4> children;  // existing children come first
    int child_count() const;
};

struct Bvh {
    std::vector<BvhNode> nodes;             // nodes, depth first from the root; empty without primitives
    std::vector<std::uint32_t> primitives;  // boxes in leaf order, ascending within a leaf; each occurs at least once
    std::uint32_t stack_entries = 0;        // size of the stack of a traversal, for any order of children
};

/// Builds a hierarchy over boxes by the surface area heuristic, one primitive per leaf. No box may be empty. The result
/// is a function of the input only. Throws Error if Embree fails.
Bvh build_bvh(std::span<const Bounds> boxes);

/// Maximum references per pair in build_pair_bvh(). Large pairs may be split between leaves (Stich, Friedrich, Dietrich
/// 2009, Spatial Splits in Bounding Volume Hierarchies). The box of each leaf then holds a part of the pair, and all of
/// them together hold the whole pair.
inline constexpr double kSplitBudget = 1.5;
enum class Splits : std::uint8_t { allowed, none };
Bvh build_pair_bvh(std::span<const Ring> pairs, Splits splits = Splits::allowed);

}  // namespace halflight::rays
