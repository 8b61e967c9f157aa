#include "engine/rays/packed_bvh.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <deque>

#include "engine/core/error.h"
#include "engine/core/release.h"
#include "engine/core/stopwatch.h"
#include "engine/rays/pair_texels.h"
#include "shaders/shared/bvh_nodes.h"

namespace halflight::rays {
namespace {

using shared::kBvhIndexMask;
using shared::kBvhTag;

// Positions and boxes pass through at most 32 roundings of 2^-24 before a decision. A division counts as five, since
// GLSL allows an error of 2.5 units in the last place. The triangle test (Woop, Benthin, Wald 2013) takes 10, the ray's
// origin on the grid 11, the slab 1, and the packing the rest.
constexpr double kSlack = 0x1p-19;
// Rays in block space are off by four roundings of |M| (|o| + t |d|) + |M| |translation|. In world space the error
// grows by the condition of M, and each of the two lengths is at most twice the reach. The block's own 32 roundings
// grow by the same factor.
constexpr double kInstanceSlack = 0x1p-17;
// Grid boxes whose area exceeds the exact one by this factor cost more than their smaller nodes gain.
constexpr double kMaxLooseness = 1.3;

struct Grid {
    vec3 base{0};
    vec3 cell{1};
};

/// Returns a grid over the bounds. Its cells are large enough that coordinates of 2^41 keep their meaning.
Grid grid_over(const Bounds& bounds) {
    if (bounds.empty()) return {};
    const vec3 extent = bounds.extent();
    const float least = std::max(std::max({extent.x, extent.y, extent.z}) * 0x1p-20f, 0x1p-60f);
    // One cell is left unused, for the rounding of the cell size itself.
    return {bounds.lower, glm::max(extent, vec3(least)) / (shared::kGridCells - 1.0f)};
}

std::uint32_t cell_below(double position, double base, double cell) {
    return static_cast<std::uint32_t>(
        std::clamp(std::floor((position - base) / cell), 0.0, double{shared::kGridCells}));
}
std::uint32_t cell_above(double position, double base, double cell) {
    return static_cast<std::uint32_t>(std::clamp(std::ceil((position - base) / cell), 0.0, double{shared::kGridCells}));
}

double half_area(const dvec3& e) {
    return e.x * e.y + e.y * e.z + e.z * e.x;
}

std::uint32_t index_word(std::size_t index, const char* what) {
    if (index > kBvhIndexMask) throw Error("rays", "more than 2^25 {}", what);
    return kBvhTag | static_cast<std::uint32_t>(index);
}

/// Widens a box by one rounding, so that earlier float arithmetic makes no difference.
Bounds widened(const dvec3& lower, const dvec3& upper) {
    const vec3 l(lower), u(upper);
    return {l - glm::abs(l) * 0x1p-22f, u + glm::abs(u) * 0x1p-22f};
}

Bounds world_box(const BlockInstance& instance, const Bounds& box) {
    if (instance.identity) return box;
    // The method is that of Arvo 1990, Transforming Axis-Aligned Bounding Boxes.
    dvec3 lower(instance.block_to_world[3]), upper = lower;
    for (int c = 0; c < 3; ++c) {
        const dvec3 a = dvec3(instance.block_to_world[c]) * double{box.lower[c]};
        const dvec3 b = dvec3(instance.block_to_world[c]) * double{box.upper[c]};
        lower += glm::min(a, b);
        upper += glm::max(a, b);
    }
    return widened(lower, upper);
}

/// Returns |M| |M^-1| in the maximum norm.
double condition_of(const BlockInstance& instance) {
    double forward = 0, backward = 0;
    for (int row = 0; row < 3; ++row) {
        double f = 0, b = 0;
        for (int c = 0; c < 3; ++c) {
            f += std::abs(double{instance.block_to_world[c][row]});
            b += std::abs(double{instance.world_to_block[c][row]});
        }
        forward = std::max(forward, f);
        backward = std::max(backward, b);
    }
    return forward * backward;
}

/// A hierarchy over triangles, or over other hierarchies below a head.
struct Tree {
    enum class Leaves : std::uint8_t {
        instances,
        roots,  // roots of the trees after it in the same space
        pairs,
    };
    const Bvh* bvh = nullptr;
    Leaves leaves = Leaves::pairs;
    std::uint32_t first_node = 0;  // index of the first node, as in references
    std::uint32_t first_pair = 0;  // first slot in PackedScene::pairs
    PartTree* spent = nullptr;     // object of `bvh`, to be freed once it is packed
};

/// A hierarchy with a head: over all instances, or of a block.
struct Space {
    Grid grid;
    float slack = static_cast<float>(kSlack);
    std::vector<Tree> trees;  // the first tree has the root
    std::uint32_t head = 0;   // node index of the head
};

/// Returns the mean ratio of a box's area on the grid to its exact area; a box without area counts as 4 at most.
double looseness_of(const std::vector<Space>& spaces) {
    double sum = 0;
    std::size_t count = 0;
    const auto add = [&](const Grid& grid, const BvhChild& child) {
        if (child.bounds.empty()) return;
        dvec3 snapped;
        for (int a = 0; a < 3; ++a) {
            const double base = grid.base[a], cell = grid.cell[a];
            snapped[a] =
                cell * (cell_above(child.bounds.upper[a], base, cell) - cell_below(child.bounds.lower[a], base, cell));
        }
        const double exact = half_area(dvec3(child.bounds.upper) - dvec3(child.bounds.lower));
        sum += half_area(snapped) < 4 * exact ? half_area(snapped) / exact : 4.0;
        ++count;
    };
    for (const Space& space : spaces)
        for (const Tree& tree : space.trees)
            for (const BvhNode& node : tree.bvh->nodes)
                for (const BvhChild& child : node.children) add(space.grid, child);
    return count == 0 ? 1.0 : sum / static_cast<double>(count);
}

std::array<uvec4, 2> head_texels(const Grid& grid, float slack) {
    const auto bits = [](float f) { return std::bit_cast<std::uint32_t>(f); };
    return {uvec4(bits(grid.base.x), bits(grid.base.y), bits(grid.base.z), bits(slack)),
            uvec4(bits(grid.cell.x), bits(grid.cell.y), bits(grid.cell.z), 0u)};
}

Bounds box_of(const Bvh& bvh) {
    Bounds box;
    for (const BvhChild& child : bvh.nodes.front().children) box.add(child.bounds);
    return box;
}

class Packer {
  public:
    /// The contents of `spent`, which is null or `trees`, are freed as soon as they are packed.
    Packer(const TraceTables& tables, const std::vector<Part>& parts, const std::vector<PartTree>& trees,
           std::vector<PartTree>* spent = nullptr, bool only_panes = false)
        : tables_(tables), parts_(parts), trees_(trees), spent_(spent), only_panes_(only_panes) {
        packed_.two_level =
            !parts.empty() && (tables.instances.size() > 1 ||
                               (!tables.instances.empty() && (tables.keep_top_level || !tables.instances[0].identity)));
        if (packed_.two_level) add_top_level();
        std::size_t pairs = 0;
        for (const PartTree& tree : trees_) pairs += tree.bvh.primitives.size();
        packed_.pairs.reserve(pairs * shared::kBvhPairTexels);
        std::size_t first = 0;
        for (std::uint32_t block = 0; block < tables.blocks.size(); ++block) {
            if (first < parts_.size() && parts_[first].block == block)
                first = add_block(first);
            else
                add_nothing();
        }
        if (spaces_.empty()) add_nothing();
        packed_.looseness = looseness_of(spaces_);
    }

    double looseness() const { return packed_.looseness; }

    /// `seconds` is the time that the hierarchies took.
    PackedScene pack(NodeFormat format, double seconds) {
        packed_.format = format;
        place_nodes();
        for (const BlockInstance& instance : tables_.instances) {
            packed_.instance_head.push_back(spaces_[instance.block + (packed_.two_level ? 1u : 0u)].head);
        }
        const std::size_t stride = on_grid() ? shared::kBvhGridTexels : shared::kBvhFloatTexels;
        packed_.nodes.reserve((packed_.node_count + spaces_.size()) * stride);
        for (const Space& space : spaces_) pack_space(space, stride);
        packed_.build_seconds = seconds + watch_.seconds();
        return std::move(packed_);
    }

  private:
    bool on_grid() const { return packed_.format == NodeFormat::grid; }

    void add_top_level() {
        std::vector<Bounds> boxes;
        Bounds all;
        double condition = 1;
        // The parts may leave out triangles of their block.
        std::vector<Bounds> block_boxes(tables_.blocks.size());
        for (std::size_t i = 0; i < parts_.size(); ++i) {
            Bounds& box = block_boxes[parts_[i].block];
            box.add(only_panes_ ? box_of(trees_[i].bvh) : tables_.blocks[parts_[i].block].bounds);
        }
        std::vector<std::uint32_t> present;
        for (std::uint32_t i = 0; i < tables_.instances.size(); ++i) {
            const BlockInstance& instance = tables_.instances[i];
            if (block_boxes[instance.block].empty()) continue;
            present.push_back(i);
            boxes.push_back(world_box(instance, block_boxes[instance.block]));
            all.add(boxes.back());
            condition = std::max(condition, condition_of(instance));
        }
        Space& top = spaces_.emplace_back();
        top.grid = grid_over(all);
        top.slack = static_cast<float>(kInstanceSlack * condition);
        Bvh bvh = build_bvh(boxes);
        for (std::uint32_t& primitive : bvh.primitives) primitive = present[primitive];
        top.trees.push_back({keep(std::move(bvh)), Tree::Leaves::instances, 0, 0});
    }

    /// Packs the parts of a block from `first` on, and returns the start of the next block.
    std::size_t add_block(std::size_t first) {
        std::size_t end = first;
        std::vector<Bounds> boxes;
        for (; end < parts_.size() && parts_[end].block == parts_[first].block; ++end)
            boxes.push_back(box_of(trees_[end].bvh));
        Space& space = spaces_.emplace_back();
        space.grid = grid_over(tables_.blocks[parts_[first].block].bounds);
        if (boxes.size() > 1) space.trees.push_back({keep(build_bvh(boxes)), Tree::Leaves::roots, 0, 0});
        for (std::size_t i = first; i < end; ++i) space.trees.push_back(add_pairs(i));
        return end;
    }

    Tree add_pairs(std::size_t index) {
        const PartTree& tree = trees_[index];
        const std::size_t slot = packed_.pairs.size() / shared::kBvhPairTexels;
        index_word(slot + tree.bvh.primitives.size(), "pairs of triangles");
        const std::vector<std::uint32_t> triangles = triangles_of(parts_[index]);
        for (const std::uint32_t primitive : tree.bvh.primitives) {
            const auto texels = pair_texels(tree.rings[primitive], tree.pairs[primitive], [&](std::uint32_t i) {
                return PairMember{triangles[i], tables_.triangles[triangles[i]].w};
            });
            packed_.pairs.insert(packed_.pairs.end(), texels.begin(), texels.end());
        }
        PartTree* const spent = spent_ ? &(*spent_)[index] : nullptr;
        if (spent) {
            release(spent->pairs);
            release(spent->rings);
            release(spent->bvh.primitives);
        }
        return {&tree.bvh, Tree::Leaves::pairs, 0, static_cast<std::uint32_t>(slot), spent};
    }

    /// Adds a root without children, for a scene without triangles or a block without panes.
    void add_nothing() {
        Bvh empty;
        empty.nodes.emplace_back();
        spaces_.emplace_back().trees.push_back({keep(std::move(empty)), Tree::Leaves::pairs, 0, 0});
    }

    const Bvh* keep(Bvh bvh) { return &made_.emplace_back(std::move(bvh)); }

    /// Sets the indices of heads and nodes, and the maximum stack of a traversal.
    void place_nodes() {
        std::size_t index = 0;
        std::uint32_t top = 0, deepest_block = 0;
        for (Space& space : spaces_) {
            space.head = index_word(index, "nodes") & kBvhIndexMask;
            ++index;
            std::uint32_t joint = 0, deepest = 0;
            for (Tree& tree : space.trees) {
                tree.first_node = static_cast<std::uint32_t>(index);
                index += tree.bvh->nodes.size();
                packed_.node_count += tree.bvh->nodes.size();
                if (tree.leaves == Tree::Leaves::roots)
                    joint = tree.bvh->stack_entries;
                else
                    deepest = std::max(deepest, tree.bvh->stack_entries);
            }
            if (space.trees.front().leaves == Tree::Leaves::instances)
                top = deepest;
            else
                deepest_block = std::max(deepest_block, joint + deepest);
        }
        index_word(index, "nodes");
        packed_.stack_entries = std::max(deepest_block, 1u);
        if (packed_.two_level) packed_.stack_entries += top + 1;  // one more entry for kStackLeaveBlock
    }

    static std::uint32_t reference_to(const BvhChild& child, const Space& space, const Tree& tree) {
        if (child.bounds.empty()) return shared::kBvhNoChild;
        if (!child.leaf()) return kBvhTag | (tree.first_node + child.first);
        switch (tree.leaves) {
            case Tree::Leaves::instances:
                return shared::kBvhInstance | index_word(tree.bvh->primitives[child.first], "instances");
            case Tree::Leaves::roots:
                return kBvhTag | space.trees[1 + tree.bvh->primitives[child.first]].first_node;
            case Tree::Leaves::pairs:
                break;
        }
        return kBvhTag | shared::kBvhLeaf | (child.count << shared::kBvhCountShift) | (tree.first_pair + child.first);
    }

    void pack_space(const Space& space, std::size_t stride) {
        const auto head = head_texels(space.grid, space.slack);
        packed_.nodes.insert(packed_.nodes.end(), head.begin(), head.end());
        packed_.nodes.resize((space.head + 1) * stride);
        for (const Tree& tree : space.trees) {
            for (const BvhNode& node : tree.bvh->nodes) pack_node(node, space, tree, stride);
            if (tree.spent) release(tree.spent->bvh.nodes);
        }
    }

    void pack_node(const BvhNode& node, const Space& space, const Tree& tree, std::size_t stride) {
        std::array<uvec4, shared::kBvhFloatTexels> texels{};
        for (int k = 0; k < 4; ++k) {
            const BvhChild& child = node.children[static_cast<std::size_t>(k)];
            for (int a = 0; a < 3; ++a) {
                if (on_grid()) {
                    put_cells(texels[static_cast<std::size_t>(a)], k, child.bounds, space.grid, a);
                } else {
                    texels[static_cast<std::size_t>(2 * a)][k] = std::bit_cast<std::uint32_t>(child.bounds.lower[a]);
                    texels[static_cast<std::size_t>(2 * a + 1)][k] =
                        std::bit_cast<std::uint32_t>(child.bounds.upper[a]);
                }
            }
            texels[on_grid() ? 3 : 6][k] = reference_to(child, space, tree);
        }
        packed_.nodes.insert(packed_.nodes.end(), texels.begin(), texels.begin() + static_cast<std::ptrdiff_t>(stride));
    }

    static void put_cells(uvec4& texel, int k, const Bounds& box, const Grid& grid, int a) {
        const std::uint32_t lower = box.empty() ? 65535u : cell_below(box.lower[a], grid.base[a], grid.cell[a]);
        const std::uint32_t upper = box.empty() ? 0u : cell_above(box.upper[a], grid.base[a], grid.cell[a]);
        texel[k / 2] |= lower << (16 * (k % 2));
        texel[2 + k / 2] |= upper << (16 * (k % 2));
    }

    const Stopwatch watch_;
    const TraceTables& tables_;
    const std::vector<Part>& parts_;
    const std::vector<PartTree>& trees_;
    std::vector<PartTree>* spent_;
    bool only_panes_;
    PackedScene packed_;
    std::deque<Bvh> made_;       // hierarchies over parts and instances
    std::vector<Space> spaces_;  // the space of instances first, if there is one, then the blocks
};

NodeFormat fitting_format(const Packer& packer) {
    return packer.looseness() <= kMaxLooseness ? NodeFormat::grid : NodeFormat::floating;
}

PackedScene packed(const TraceTables& tables, Packer packer, double seconds) {
    PackedScene scene = packer.pack(fitting_format(packer), seconds);
    scene.panes = pack_panes(tables);
    return scene;
}

}  // namespace

std::vector<uvec4> packed_head(const Bounds& block) {
    const auto head = head_texels(grid_over(block), static_cast<float>(kSlack));
    return {head.begin(), head.end()};
}

std::shared_ptr<PackedScene> pack_panes(const TraceTables& tables) {
    if (!tables.panes) return nullptr;
    const std::vector<Part> parts = pane_parts_of(tables);
    std::vector<PartTree> trees(parts.size());
    tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t i) { trees[i] = build_tree(tables, parts[i]); });
    Packer packer(tables, parts, trees, nullptr, true);
    return std::make_shared<PackedScene>(packer.pack(fitting_format(packer), 0));
}

PackedScene pack_boxes(const Bvh& bvh, const Bounds& bounds) {
    TraceTables tables;
    tables.blocks.push_back({.bounds = bounds});
    tables.instances.push_back({.identity = true});
    std::vector<PartTree> trees(1);
    trees.front().bvh.nodes = bvh.nodes;
    trees.front().bvh.stack_entries = bvh.stack_entries;
    return Packer(tables, {Part()}, trees).pack(NodeFormat::grid, 0);
}

PackedScene pack_scene(const TraceTables& tables, const Hierarchies& hierarchies) {
    return packed(tables, Packer(tables, hierarchies.parts(), hierarchies.trees()), hierarchies.seconds());
}

PackedScene pack_scene(const TraceTables& tables, Hierarchies&& hierarchies) {
    std::vector<PartTree> trees = std::move(hierarchies).trees();
    return packed(tables, Packer(tables, hierarchies.parts(), trees, &trees), hierarchies.seconds());
}

PackedScene pack_scene(const TraceTables& tables) {
    return pack_scene(tables, Hierarchies(tables));
}

PackedScene pack_scene(const TraceTables& tables, NodeFormat format) {
    const Hierarchies hierarchies(tables);
    PackedScene scene = Packer(tables, hierarchies.parts(), hierarchies.trees()).pack(format, hierarchies.seconds());
    scene.panes = pack_panes(tables);
    return scene;
}

}  // namespace halflight::rays
