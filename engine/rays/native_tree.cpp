#include "engine/rays/native_tree.h"

#include <algorithm>
#include <bit>
#include <functional>
#include <map>

#include "engine/tables/instance_rows.h"
#include "shaders/shared/bvh.h"
#include "shaders/shared/instances.h"

namespace halflight::rays {
namespace {

using shared::kBvhIndexMask;
using shared::kBvhNoChild;
using shared::kBvhTag;

float as_float(std::uint32_t word) {
    return std::bit_cast<float>(word);
}

/// A child of a packed node. Bounds are cells or bits of floats.
struct Child {
    std::array<std::uint32_t, 6> bounds{};
    std::uint32_t reference = kBvhNoChild;
    float area = 0;      // half the area of the box, in the units of the space
    bool stays = false;  // the node below has too many children for the place
};

class Collapser {
  public:
    Collapser(NativeTree& tree, std::span<const uvec4> nodes) : tree_(tree), nodes_(nodes) {}

    /// Adds the hierarchy with the head at this node index; returns the index of its space.
    std::uint32_t add_space(std::uint32_t head) {
        NativeSpace space;
        const uvec4 &base = nodes_[head * stride()], &cell = nodes_[head * stride() + 1];
        space.base = {as_float(base.x), as_float(base.y), as_float(base.z)};
        space.slack = as_float(base.w);
        space.cell = {as_float(cell.x), as_float(cell.y), as_float(cell.z)};
        cell_ = on_grid() ? space.cell : vec3(1);
        const Added root = add_node(head + 1);
        space.root = root.reference;
        deepest_ = std::max(deepest_, root.stack);
        tree_.spaces.push_back(space);
        return static_cast<std::uint32_t>(tree_.spaces.size() - 1);
    }

    /// Returns the maximum stack of a traversal of one of the spaces so far, entries.
    std::size_t deepest() const { return deepest_; }

  private:
    struct Added {
        std::uint32_t reference = 0;
        std::size_t stack = 0;  // entries that a traversal from here needs
    };

    bool on_grid() const { return tree_.format == NodeFormat::grid; }
    std::size_t stride() const { return on_grid() ? shared::kBvhGridTexels : shared::kBvhFloatTexels; }

    /// Appends the children of a packed node.
    void read(std::uint32_t index, std::vector<Child>& children) const {
        const uvec4* const texels = &nodes_[index * stride()];
        for (int k = 0; k < 4; ++k) {
            Child child;
            child.reference = texels[on_grid() ? 3 : 6][k];
            if (child.reference == kBvhNoChild) continue;
            vec3 extent;
            for (int a = 0; a < 3; ++a) {
                auto &lower = child.bounds[static_cast<std::size_t>(2 * a)],
                     &upper = child.bounds[static_cast<std::size_t>(2 * a + 1)];
                if (on_grid()) {
                    lower = (texels[a][k / 2] >> (16 * (k % 2))) & 0xffffu;
                    upper = (texels[a][2 + k / 2] >> (16 * (k % 2))) & 0xffffu;
                    extent[a] = cell_[a] * (static_cast<float>(upper) - static_cast<float>(lower));
                } else {
                    lower = texels[2 * a][k], upper = texels[2 * a + 1][k];
                    extent[a] = as_float(upper) - as_float(lower);
                }
            }
            child.area = extent.x * extent.y + extent.y * extent.z + extent.z * extent.x;
            children.push_back(child);
        }
    }

    /// Returns an estimate of the rays that a child ends, relative to its cost.
    float promise_of(const Child& child) const {
        constexpr float kInnerCost = 3;  // found by experiment; unit: a pair
        const std::uint32_t pairs = (child.reference >> shared::kBvhCountShift) & 7u;
        return child.area / (shared::is_leaf(child.reference) ? static_cast<float>(pairs) : kInnerCost);
    }

    /// Adds the eight-wide node over the subtree of a packed node: its children, of which the largest ones are replaced
    /// by their own children while there is room.
    Added add_node(std::uint32_t packed) {
        std::vector<Child> children, of_child;
        read(packed, children);
        for (;;) {
            std::size_t largest = children.size();
            for (std::size_t i = 0; i < children.size(); ++i) {
                if (!shared::is_inner_node(children[i].reference) || children[i].stays) continue;
                if (largest == children.size() || children[i].area > children[largest].area) largest = i;
            }
            if (largest == children.size()) break;
            of_child.clear();
            read(children[largest].reference & kBvhIndexMask, of_child);
            if (children.size() - 1 + of_child.size() > kNativeWidth) {
                children[largest].stays = true;
                continue;
            }
            children.erase(children.begin() + static_cast<std::ptrdiff_t>(largest));
            children.insert(children.end(), of_child.begin(), of_child.end());
        }
        const std::size_t at = on_grid() ? tree_.grid_nodes.size() : tree_.float_nodes.size();
        on_grid() ? tree_.grid_nodes.resize(at + 1) : tree_.float_nodes.resize(at + 1);
        std::size_t below = 0;
        for (Child& child : children) {
            if (!shared::is_inner_node(child.reference)) continue;
            const Added added = add_node(child.reference & kBvhIndexMask);
            child.reference = added.reference;
            below = std::max(below, added.stack);
        }
        // Any hits search children in this order: those that end a ray at the least cost come first.
        std::ranges::stable_sort(children, std::greater(), [&](const Child& child) { return promise_of(child); });
        children.resize(kNativeWidth, nothing());
        for (std::size_t i = 0; i < kNativeWidth; ++i) {
            if (on_grid())
                put(tree_.grid_nodes[at], i, children[i]);
            else
                put(tree_.float_nodes[at], i, children[i]);
        }
        return {kBvhTag | static_cast<std::uint32_t>(at), below + kNativeWidth};
    }

    Child nothing() const {
        const std::uint32_t lower = on_grid() ? 65535u : std::bit_cast<std::uint32_t>(kInfinity);
        const std::uint32_t upper = on_grid() ? 0u : std::bit_cast<std::uint32_t>(-kInfinity);
        return {{lower, upper, lower, upper, lower, upper}, kBvhNoChild, 0, false};
    }

    template <class Bound>
    static void put(NativeNode<Bound>& node, std::size_t at, const Child& child) {
        for (std::size_t i = 0; i < child.bounds.size(); ++i) {
            if constexpr (std::is_same_v<Bound, float>)
                node.bounds[i][at] = as_float(child.bounds[i]);
            else
                node.bounds[i][at] = static_cast<Bound>(child.bounds[i]);
        }
        node.reference[at] = child.reference;
    }

    NativeTree& tree_;
    std::span<const uvec4> nodes_;
    vec3 cell_{1};
    std::size_t deepest_ = 0;
};

}  // namespace

std::size_t NativeTree::bytes() const {
    return grid_nodes.size() * sizeof(grid_nodes[0]) + float_nodes.size() * sizeof(float_nodes[0]) +
           spaces.size() * sizeof(NativeSpace) + instance_space.size() * sizeof(std::uint32_t) +
           world_to_block.size() * sizeof(world_to_block[0]);
}

NativeTree build_native_tree(const TraceTables& tables, NodeFormat format, bool two_level, std::span<const uvec4> nodes,
                             std::span<const std::uint32_t> heads) {
    NativeTree tree;
    tree.format = format;
    tree.two_level = two_level;
    Collapser collapser(tree, nodes);
    std::map<std::uint32_t, std::uint32_t> space_of;  // by head
    space_of[0] = collapser.add_space(0);
    const std::size_t top = collapser.deepest();
    for (const std::uint32_t head : heads) {
        if (!space_of.contains(head)) space_of[head] = collapser.add_space(head);
        tree.instance_space.push_back(space_of[head]);
    }
    tree.stack_entries = collapser.deepest() + (two_level ? top : 0) + 1;
    const std::vector<vec4> rows = instance_rows(tables);
    for (std::size_t i = 0; i < tables.instances.size(); ++i) {
        const vec4* const row = &rows[i * shared::kInstanceStride + shared::kInstanceWorldToBlock];
        tree.world_to_block.push_back({row[0], row[1], row[2]});
    }
    return tree;
}

}  // namespace halflight::rays
