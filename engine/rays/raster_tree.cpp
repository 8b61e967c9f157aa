#include "engine/rays/raster_tree.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "shaders/shared/bvh_nodes.h"
#include "shaders/shared/raster_lists.h"

namespace halflight::rays {
namespace {

using shared::kBvhIndexMask;

/// Reader of hierarchies in the layout of shaders/shared/bvh_nodes.h.
class PackedReader {
  public:
    struct Head {
        dvec3 base;
        dvec3 cell;
        float slack;
    };

    explicit PackedReader(const PackedScene& packed)
        : packed_(packed),
          on_grid_(packed.format == NodeFormat::grid),
          stride_(on_grid_ ? shared::kBvhGridTexels : shared::kBvhFloatTexels) {}

    Head head(std::uint32_t index) const {
        const uvec4 base = texel(index, 0), cell = texel(index, 1);
        const auto real = [](std::uint32_t bits) { return double{std::bit_cast<float>(bits)}; };
        return {{real(base.x), real(base.y), real(base.z)},
                {real(cell.x), real(cell.y), real(cell.z)},
                std::bit_cast<float>(base.w)};
    }

    std::uint32_t reference(std::uint32_t node, int slot) const { return texel(node, on_grid_ ? 3 : 6)[slot]; }

    struct Box {
        dvec3 lower;
        dvec3 upper;
    };
    Box box(const Head& head, std::uint32_t node, int slot) const {
        Box box;
        for (int a = 0; a < 3; ++a) {
            if (on_grid_) {
                const uvec4 t = texel(node, a);
                const auto cell = [&](int pair) { return double((t[pair + slot / 2] >> (16 * (slot % 2))) & 0xffffu); };
                box.lower[a] = head.base[a] + head.cell[a] * cell(0);
                box.upper[a] = head.base[a] + head.cell[a] * cell(2);
            } else {
                box.lower[a] = std::bit_cast<float>(texel(node, 2 * a)[slot]);
                box.upper[a] = std::bit_cast<float>(texel(node, 2 * a + 1)[slot]);
            }
        }
        return box;
    }

  private:
    const uvec4& texel(std::uint32_t index, int i) const {
        return packed_.nodes[std::size_t{index} * static_cast<std::size_t>(stride_) + static_cast<std::size_t>(i)];
    }
    const PackedScene& packed_;
    bool on_grid_;
    int stride_;
};

bool exists(std::uint32_t reference) {
    return reference != shared::kBvhNoChild;
}
bool is_instance(std::uint32_t reference) {
    return (reference & shared::kBvhInstance) != 0;
}

class TreeBuilder {
  public:
    TreeBuilder(const PackedScene& packed, const CutSizes& sizes)
        : packed_(packed), sizes_(sizes), reader_(packed), head_(reader_.head(0)) {
        const std::size_t stride = packed.format == NodeFormat::grid ? shared::kBvhGridTexels : shared::kBvhFloatTexels;
        below_.assign(packed.nodes.size() / stride, kUnknown);
        tree_.slack = head_.slack;
        tree_.hull = outwards(head_.base, head_.base + double{shared::kGridCells} * head_.cell);
    }

    CullTree build() {
        if (triangles_below(kRoot) == 0) return std::move(tree_);
        tree_.nodes.push_back(node_of(kRoot, existing_slots(kRoot)));
        expand(0);
        survey();
        return std::move(tree_);
    }

  private:
    static constexpr std::size_t kUnknown = ~std::size_t{0};
    static constexpr std::uint32_t kRoot = 1;

    static Bounds outwards(const dvec3& lower, const dvec3& upper) {
        Bounds box;
        for (int a = 0; a < 3; ++a) {
            const auto l = static_cast<float>(lower[a]), u = static_cast<float>(upper[a]);
            box.lower[a] = l <= lower[a] ? l : std::nextafter(l, -kInfinity);
            box.upper[a] = u >= upper[a] ? u : std::nextafter(u, kInfinity);
        }
        return box;
    }

    std::size_t triangles_of(std::uint32_t reference) {
        if (is_instance(reference)) {
            return triangles_below(packed_.instance_head[reference & kBvhIndexMask] + kRoot);
        }
        if (shared::is_leaf(reference))
            return 2 * ((reference >> shared::kBvhCountShift) & 7u);  // at most two triangles per pair
        return triangles_below(reference & kBvhIndexMask);
    }

    std::size_t triangles_below(std::uint32_t node) {
        if (below_[node] == kUnknown) {
            std::size_t sum = 0;
            for (int slot = 0; slot < 4; ++slot) {
                const std::uint32_t reference = reader_.reference(node, slot);
                if (exists(reference)) sum += triangles_of(reference);
            }
            below_[node] = sum;
        }
        return below_[node];
    }

    /// Returns the slots of children that are too small for a node of their own.
    std::uint32_t small_slots(std::uint32_t node) {
        std::uint32_t slots = 0;
        for (int slot = 0; slot < 4; ++slot) {
            const std::uint32_t reference = reader_.reference(node, slot);
            if (exists(reference) &&
                (shared::is_leaf(reference) || 8 * triangles_of(reference) <= sizes_.leaf_triangles)) {
                slots |= 1u << slot;
            }
        }
        return slots;
    }

    std::uint32_t existing_slots(std::uint32_t node) const {
        std::uint32_t slots = 0;
        for (int slot = 0; slot < 4; ++slot) slots |= exists(reader_.reference(node, slot)) ? 1u << slot : 0u;
        return slots;
    }

    CullNode node_of(std::uint32_t node, std::uint32_t slots) const {
        CullNode result;
        result.node = node;
        result.slots = slots;
        for (int slot = 0; slot < 4; ++slot) {
            if ((slots >> slot & 1u) == 0) continue;
            const PackedReader::Box box = reader_.box(head_, node, slot);
            result.box.add(outwards(box.lower, box.upper));
        }
        return result;
    }

    /// Divides tree_.nodes[index], which has all children of its node. The small children become one node; every other
    /// child becomes its own node.
    void expand(std::uint32_t index) {
        const std::uint32_t node = tree_.nodes[index].node;
        if (triangles_below(node) <= sizes_.leaf_triangles) return;
        const std::uint32_t small = small_slots(node);
        std::vector<CullNode> children;
        if (small != 0) children.push_back(node_of(node, small));
        for (int slot = 0; slot < 4; ++slot) {
            const std::uint32_t reference = reader_.reference(node, slot);
            if (!exists(reference) || (small >> slot & 1u) != 0) continue;
            const std::uint32_t below = reference & kBvhIndexMask;
            children.push_back(is_instance(reference) ? node_of(node, 1u << slot)
                                                      : node_of(below, existing_slots(below)));
        }
        const auto first = static_cast<std::uint32_t>(tree_.nodes.size());
        tree_.nodes[index].first_child = first;
        tree_.nodes[index].child_count = static_cast<std::uint32_t>(children.size());
        tree_.nodes.insert(tree_.nodes.end(), children.begin(), children.end());
        for (std::uint32_t c = first; c < first + children.size(); ++c) {
            tree_.nodes[c].parent = index;
            if (tree_.nodes[c].node != node) expand(c);
        }
    }

    /// Expands nodes breadth first from the root until the survey is full.
    void survey() {
        std::vector<std::uint32_t>& nodes = tree_.survey;
        nodes = {0};
        for (std::size_t i = 0; i < nodes.size();) {
            const CullNode& node = tree_.nodes[nodes[i]];
            if (node.child_count == 0 || nodes.size() - 1 + node.child_count > shared::kRasterCandidates) {
                ++i;
                continue;
            }
            nodes.erase(nodes.begin() + static_cast<std::ptrdiff_t>(i));
            for (std::uint32_t c = 0; c < node.child_count; ++c) nodes.push_back(node.first_child + c);
        }
    }

    const PackedScene& packed_;
    CutSizes sizes_;
    PackedReader reader_;
    PackedReader::Head head_;
    std::vector<std::size_t> below_;  // number of triangles, by node
    CullTree tree_;
};

}  // namespace

CullTree build_cull_tree(const PackedScene& packed, const CutSizes& sizes) {
    CutSizes s = sizes;
    while (true) {
        CullTree tree = TreeBuilder(packed, s).build();
        if (tree.nodes.size() <= s.most_nodes || tree.nodes.size() == 1) return tree;
        s.leaf_triangles *= 2;
    }
}

}  // namespace halflight::rays
