// Eight-wide nodes of a scene for native tracing, collapsed from the packed four-wide ones. No OpenGL is used.
//
// The leaves and their boxes are those of the packed hierarchy, so that hits are raised to the same entries. Inner
// boxes are unions of them, which changes no hit. Packed nodes are divided into binary ones first. Otherwise a packed
// node would fill four of eight places, or seven if one child gives way to its own children.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/math.h"
#include "engine/rays/packed_bvh.h"
#include "engine/tables/tables.h"

namespace halflight::rays {

inline constexpr int kNativeWidth = 8;

/// A node with eight children. Missing children come last; their boxes are empty and their references leaves without
/// pairs. `bounds` has lower and upper bounds for each axis in turn: cells of the space's grid (NodeFormat::grid), or
/// units of the space (NodeFormat::floating).
template <class Bound>
struct alignas(64) NativeNode {
    std::array<std::array<Bound, kNativeWidth>, 6> bounds;
    // References as in shaders/shared/bvh_nodes.h; those to nodes are indices of eight-wide nodes.
    std::array<std::uint32_t, kNativeWidth> reference;
};
static_assert(sizeof(NativeNode<std::uint16_t>) == 128 && sizeof(NativeNode<float>) == 256);

/// A hierarchy over instances, or of a block, with the constants of its head (shaders/shared/bvh_nodes.h).
struct NativeSpace {
    vec3 base{0};
    vec3 cell{1};
    float slack = 0;
    std::uint32_t root = 0;  // reference
};

struct NativeTree {
    NodeFormat format = NodeFormat::grid;
    bool two_level = false;
    std::vector<NativeNode<std::uint16_t>> grid_nodes;  // nodes of NodeFormat::grid
    std::vector<NativeNode<float>> float_nodes;         // nodes of NodeFormat::floating
    std::vector<NativeSpace> spaces;                    // the space where traversal starts comes first
    std::vector<std::uint32_t> instance_space;          // per instance: index of its block's space
    std::vector<std::array<vec4, 3>> world_to_block;    // per instance: rows of the matrix
    std::size_t stack_entries = 0;                      // maximum entries of a traversal's stack

    std::size_t bytes() const;
};

/// Collapses packed nodes. `nodes` and `heads` are PackedScene::nodes and ::instance_head of the tables; the format is
/// not NodeFormat::page.
NativeTree build_native_tree(const TraceTables& tables, NodeFormat format, bool two_level, std::span<const uvec4> nodes,
                             std::span<const std::uint32_t> heads);

}  // namespace halflight::rays
