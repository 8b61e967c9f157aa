#include "engine/rays/native_tree.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <functional>
#include <map>
#include <numeric>

#include "engine/tables/instance_rows.h"
#include "shaders/shared/bvh_nodes.h"
#include "shaders/shared/instance_texels.h"

namespace halflight::rays {
namespace {

using shared::kBvhIndexMask;
using shared::kBvhNoChild;
using shared::kBvhTag;

float as_float(std::uint32_t word) {
    return std::bit_cast<float>(word);
}

constexpr std::size_t kPackedWidth = 4;

/// A child of a packed node, or several of them joined. Bounds are cells or bits of floats.
struct Child {
    std::array<std::uint32_t, 6> bounds{};
    std::uint32_t reference = kBvhNoChild;  // joined children: that of their packed node
    std::size_t member = 0;                 // joined children: index of Family::members
    float area = 0;                         // half the area of the box, in the units of the space
};

/// A packed node as a binary tree: its children, then pairs of earlier members, joined by least area. The last member
/// is the root.
struct Family {
    std::array<Child, 2 * kPackedWidth - 1> members;
    std::array<std::array<std::size_t, 2>, 2 * kPackedWidth - 1> parts{};  // indices, for joined members
    std::size_t children = 0, count = 0;
};

/// How the joined members of a packed node are best divided among the children of eight-wide nodes.
struct Plan {
    // Per joined member and number of places: the places of its first part. 0: a place stays free. A member with one
    // place is a node, and the entry divides the places of that node.
    std::array<std::array<std::uint8_t, kNativeWidth + 1>, kPackedWidth - 1> first{};
};

/// Least cost of a binary tree by the number of places that it may take: the summed areas of the eight-wide nodes.
using Costs = std::array<float, kNativeWidth + 1>;

class Collapser {
  public:
    Collapser(NativeTree& tree, std::span<const uvec4> nodes)
        : tree_(tree), nodes_(nodes), plans_(nodes.size() / stride()) {}

    /// Adds the hierarchy with the head at this node index; returns the index of its space.
    std::uint32_t add_space(std::uint32_t head) {
        NativeSpace space;
        const uvec4 &base = nodes_[head * stride()], &cell = nodes_[head * stride() + 1];
        space.base = {as_float(base.x), as_float(base.y), as_float(base.z)};
        space.slack = as_float(base.w);
        space.cell = {as_float(cell.x), as_float(cell.y), as_float(cell.z)};
        cell_ = on_grid() ? space.cell : vec3(1);
        costs_of(head + 1);
        const Added root = add_node(root_of(head + 1));
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

    Family family_of(std::uint32_t packed) const {
        Family family;
        const uvec4* const texels = &nodes_[packed * stride()];
        for (int k = 0; k < 4; ++k) {
            Child child;
            child.reference = texels[on_grid() ? 3 : 6][k];
            if (child.reference == kBvhNoChild) continue;
            for (int a = 0; a < 3; ++a) {
                auto &lower = child.bounds[static_cast<std::size_t>(2 * a)],
                     &upper = child.bounds[static_cast<std::size_t>(2 * a + 1)];
                if (on_grid()) {
                    lower = (texels[a][k / 2] >> (16 * (k % 2))) & 0xffffu;
                    upper = (texels[a][2 + k / 2] >> (16 * (k % 2))) & 0xffffu;
                } else {
                    lower = texels[2 * a][k], upper = texels[2 * a + 1][k];
                }
            }
            child.area = area_of(child.bounds);
            family.members[family.count++] = child;
        }
        family.children = family.count;
        std::vector<std::size_t> apart(family.children);
        std::iota(apart.begin(), apart.end(), std::size_t{0});
        while (apart.size() > 1) {
            Child best;
            std::size_t one = 0, other = 0;
            for (std::size_t j = 1; j < apart.size(); ++j) {
                for (std::size_t i = 0; i < j; ++i) {
                    const auto bounds = united(family.members[apart[i]].bounds, family.members[apart[j]].bounds);
                    const float area = area_of(bounds);
                    if (other != 0 && area >= best.area) continue;
                    best = {bounds, kBvhTag | packed, family.count, area};
                    one = i, other = j;
                }
            }
            family.parts[family.count] = {apart[one], apart[other]};
            apart[one] = family.count;
            apart.erase(apart.begin() + static_cast<std::ptrdiff_t>(other));
            family.members[family.count++] = best;
        }
        return family;
    }

    std::array<std::uint32_t, 6> united(const std::array<std::uint32_t, 6>& a,
                                        const std::array<std::uint32_t, 6>& b) const {
        const auto below = [&](std::uint32_t x, std::uint32_t y) {
            return on_grid() ? x < y : as_float(x) < as_float(y);
        };
        std::array<std::uint32_t, 6> all;
        for (std::size_t i = 0; i < all.size(); ++i)
            all[i] = i % 2 == 0 ? std::min(a[i], b[i], below) : std::max(a[i], b[i], below);
        return all;
    }

    float area_of(const std::array<std::uint32_t, 6>& bounds) const {
        vec3 e;
        for (int a = 0; a < 3; ++a) {
            const std::uint32_t lower = bounds[static_cast<std::size_t>(2 * a)],
                                upper = bounds[static_cast<std::size_t>(2 * a + 1)];
            e[a] = on_grid() ? cell_[a] * (static_cast<float>(upper) - static_cast<float>(lower))
                             : as_float(upper) - as_float(lower);
        }
        return e.x * e.y + e.y * e.z + e.z * e.x;
    }

    /// Sets the plans of the packed nodes of a subtree. The method is that of Ylitie, Karras, Laine 2017, Efficient
    /// Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs, section 3.2, with leaves that stay as they are.
    Costs costs_of(std::uint32_t packed) {
        const Family family = family_of(packed);
        std::array<Costs, 2 * kPackedWidth - 1> costs{};
        for (std::size_t m = 0; m < family.children; ++m) {
            const std::uint32_t reference = family.members[m].reference;
            if (shared::is_inner_node(reference)) costs[m] = costs_of(reference & kBvhIndexMask);
        }
        for (std::size_t m = family.children; m < family.count; ++m) {
            const Costs &left = costs[family.parts[m][0]], &right = costs[family.parts[m][1]];
            auto& first = plans_[packed].first[m - family.children];
            Costs divided;
            for (std::size_t places = 2; places <= kNativeWidth; ++places) {
                divided[places] = kInfinity;
                for (std::size_t k = 1; k < places; ++k) {
                    if (!(left[k] + right[places - k] < divided[places])) continue;
                    divided[places] = left[k] + right[places - k];
                    first[places] = static_cast<std::uint8_t>(k);
                }
            }
            costs[m][1] = divided[kNativeWidth] + family.members[m].area;
            first[1] = first[kNativeWidth];
            for (std::size_t places = 2; places <= kNativeWidth; ++places) {
                const bool gains = divided[places] < costs[m][places - 1];
                costs[m][places] = gains ? divided[places] : costs[m][places - 1];
                if (!gains) first[places] = 0;
            }
        }
        return family.count == 0 ? Costs{} : costs[family.count - 1];
    }

    /// Returns the root of a packed node's binary tree: a leaf, or joined members.
    Child root_of(std::uint32_t packed) const {
        const Family family = family_of(packed);
        if (family.count == 0) return nothing();
        const Child& root = family.members[family.count - 1];
        const bool passes = family.count == 1 && shared::is_inner_node(root.reference);
        return passes ? root_of(root.reference & kBvhIndexMask) : root;
    }

    /// Appends the children that take the given number of places for a member of a family.
    void divide(const Family& family, std::size_t member, std::size_t places, std::vector<Child>& children) const {
        const Child& child = family.members[member];
        if (!shared::is_inner_node(child.reference)) {
            children.push_back(child);
        } else if (member < family.children) {
            const Family below = family_of(child.reference & kBvhIndexMask);
            if (below.count != 0) divide(below, below.count - 1, places, children);
        } else {
            const auto& first = plans_[child.reference & kBvhIndexMask].first[member - family.children];
            while (places > 1 && first[places] == 0) --places;
            if (places == 1) return children.push_back(child);
            divide(family, family.parts[member][0], first[places], children);
            divide(family, family.parts[member][1], places - first[places], children);
        }
    }

    /// Returns an estimate of the rays that a child ends, relative to its cost.
    float promise_of(const Child& child) const {
        constexpr float kInnerCost = 3;  // found by experiment; unit: a pair
        const std::uint32_t pairs = (child.reference >> shared::kBvhCountShift) & 7u;
        return child.area / (shared::is_leaf(child.reference) ? static_cast<float>(pairs) : kInnerCost);
    }

    /// Adds the eight-wide node of joined members, or of a leaf alone.
    Added add_node(const Child& root) {
        std::vector<Child> children;
        if (shared::is_inner_node(root.reference)) {
            const std::uint32_t packed = root.reference & kBvhIndexMask;
            const Family family = family_of(packed);
            const std::size_t first = plans_[packed].first[root.member - family.children][1];
            divide(family, family.parts[root.member][0], first, children);
            divide(family, family.parts[root.member][1], kNativeWidth - first, children);
        } else if (root.reference != kBvhNoChild) {
            children.push_back(root);
        }
        const std::size_t at = on_grid() ? tree_.grid_nodes.size() : tree_.float_nodes.size();
        on_grid() ? tree_.grid_nodes.resize(at + 1) : tree_.float_nodes.resize(at + 1);
        std::size_t below = 0;
        for (Child& child : children) {
            if (!shared::is_inner_node(child.reference)) continue;
            const Added added = add_node(child);
            child.reference = added.reference;
            below = std::max(below, added.stack);
        }
        // Searches for any hit visit children in this order: those that end a ray at the least cost come first.
        std::ranges::stable_sort(children, std::greater(), [&](const Child& child) { return promise_of(child); });
        assert(children.size() <= kNativeWidth);  // divide() gives each part no more than its share
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
        return {{lower, upper, lower, upper, lower, upper}, kBvhNoChild, 0, 0};
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
    std::vector<Plan> plans_;  // by index of packed nodes
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
