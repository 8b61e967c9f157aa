#include "engine/rays/raster_tree.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "shaders/shared/bvh.h"
#include "shaders/shared/raster.h"

namespace halflight::rays {
namespace {

using shared::kBvhIndexMask;

/// Reads hierarchies in the layout of shaders/shared/bvh.h.
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
bool is_leaf(std::uint32_t reference) {
    return !is_instance(reference) && (reference & shared::kBvhLeaf) != 0;
}

class TreeBuilder {
  public:
    TreeBuilder(const PackedScene& packed, const TraceTables& tables, const CutSizes& sizes)
        : packed_(packed), tables_(tables), sizes_(sizes), reader_(packed) {
        const std::size_t stride = packed.format == NodeFormat::grid ? shared::kBvhGridTexels : shared::kBvhFloatTexels;
        below_.assign(packed.nodes.size() / stride, kUnknown);
        const PackedReader::Head head = reader_.head(0);
        tree_.slack = head.slack;
        tree_.hull = outwards(head.base, head.base + double{shared::kGridCells} * head.cell);
        tree_.spaces.emplace_back();
    }

    CullTree build() {
        const std::size_t all = triangles_below(kRoot);
        if (all == 0) return std::move(tree_);
        // An instance is entered where it holds much of the scene: at most so many times.
        entered_triangles_ = std::max(sizes_.leaf_triangles, all / kMostEntered);
        const Place world{reader_.head(0), 0};
        tree_.pieces.push_back(piece_of(world, kRoot, existing_slots(kRoot)));
        tree_.nodes.emplace_back();
        expand(0, kRoot, world);
        for (std::size_t i = tree_.nodes.size(); i-- > 1;)
            tree_.nodes[tree_.nodes[i].parent].box.add(tree_.nodes[i].box);
        survey();
        return std::move(tree_);
    }

  private:
    static constexpr std::size_t kUnknown = ~std::size_t{0};
    static constexpr std::size_t kMostEntered = 32;
    static constexpr std::uint32_t kRoot = 1;

    struct Place {
        PackedReader::Head head;
        std::uint32_t space;
    };

    static Bounds outwards(const dvec3& lower, const dvec3& upper) {
        Bounds box;
        for (int a = 0; a < 3; ++a) {
            const auto l = static_cast<float>(lower[a]), u = static_cast<float>(upper[a]);
            box.lower[a] = l <= lower[a] ? l : std::nextafter(l, -kInfinity);
            box.upper[a] = u >= upper[a] ? u : std::nextafter(u, kInfinity);
        }
        return box;
    }

    Bounds world_box(const Place& place, std::uint32_t node, int slot) const {
        const PackedReader::Box box = reader_.box(place.head, node, slot);
        const std::uint32_t instance = tree_.spaces[place.space].instance;
        if (instance == Space::kWorld || tables_.instances[instance].identity) return outwards(box.lower, box.upper);
        // Arvo 1990, Transforming Axis-Aligned Bounding Boxes.
        const glm::mat4x3& m = tables_.instances[instance].block_to_world;
        dvec3 lower(m[3]), upper = lower;
        for (int c = 0; c < 3; ++c) {
            const dvec3 a = dvec3(m[c]) * box.lower[c], b = dvec3(m[c]) * box.upper[c];
            lower += glm::min(a, b);
            upper += glm::max(a, b);
        }
        return outwards(lower, upper);
    }

    std::size_t triangles_of(std::uint32_t reference) {
        if (is_instance(reference)) {
            return triangles_below(packed_.instance_head[reference & kBvhIndexMask] + kRoot);
        }
        if (is_leaf(reference)) return (reference >> shared::kBvhCountShift) & 7u;
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

    bool enters(std::uint32_t reference) {
        return is_instance(reference) && triangles_of(reference) > entered_triangles_;
    }

    /// Children that go into one piece together: it would not pay to tell them apart.
    std::uint32_t small_slots(std::uint32_t node) {
        std::uint32_t slots = 0;
        for (int slot = 0; slot < 4; ++slot) {
            const std::uint32_t reference = reader_.reference(node, slot);
            if (exists(reference) && (is_leaf(reference) || 4 * triangles_of(reference) <= sizes_.piece_triangles)) {
                slots |= 1u << slot;
            }
        }
        return slots;
    }

    Piece piece_of(const Place& place, std::uint32_t node, std::uint32_t slots) const {
        Piece piece{{}, node, slots};
        for (int slot = 0; slot < 4; ++slot) {
            if ((slots >> slot & 1u) != 0) piece.box.add(world_box(place, node, slot));
        }
        return piece;
    }

    /// The piece cut by one level: its small children together, each other one for itself.
    std::vector<Piece> parts_of(const Place& place, const Piece& piece) {
        std::vector<Piece> parts;
        const std::uint32_t small = small_slots(piece.node) & piece.slots;
        if (small != 0) parts.push_back(piece_of(place, piece.node, small));
        for (int slot = 0; slot < 4; ++slot) {
            if (((piece.slots & ~small) >> slot & 1u) == 0) continue;
            const std::uint32_t reference = reader_.reference(piece.node, slot);
            if (is_instance(reference)) {
                parts.push_back(piece_of(place, piece.node, 1u << slot));
            } else {
                const std::uint32_t below = reference & kBvhIndexMask;
                parts.push_back(piece_of(place, below, existing_slots(below)));
            }
        }
        return parts;
    }

    std::size_t triangles_of(const Piece& piece) {
        std::size_t sum = 0;
        for (int slot = 0; slot < 4; ++slot) {
            if ((piece.slots >> slot & 1u) != 0) sum += triangles_of(reader_.reference(piece.node, slot));
        }
        return sum;
    }

    /// The piece, and parts of it: the one with the most triangles is cut, again and again, as long as there is room.
    void fill_leaf(std::uint32_t index, const Place& place, const Piece& whole) {
        struct Part {
            Piece piece;
            std::size_t triangles;
        };
        std::vector<Part> parts{{whole, triangles_of(whole)}};
        while (true) {
            const auto most = std::max_element(parts.begin(), parts.end(),
                                               [](const Part& a, const Part& b) { return a.triangles < b.triangles; });
            if (most->triangles <= sizes_.piece_triangles) break;
            const std::vector<Piece> cut = parts_of(place, most->piece);
            const bool same = cut.size() == 1 && cut[0].node == most->piece.node;
            if (same || parts.size() - 1 + cut.size() >= shared::kRasterLeafPieces) {
                most->triangles = 0;  // stays as it is
                continue;
            }
            *most = {cut[0], triangles_of(cut[0])};
            for (std::size_t i = 1; i < cut.size(); ++i) parts.push_back({cut[i], triangles_of(cut[i])});
        }
        CullNode& leaf = tree_.nodes[index];
        leaf.box = whole.box;
        leaf.space = place.space;
        leaf.first_piece = static_cast<std::uint32_t>(tree_.pieces.size());
        tree_.pieces.push_back(whole);
        if (parts.size() > 1) {
            for (const Part& part : parts) tree_.pieces.push_back(part.piece);
        }
        leaf.piece_count = static_cast<std::uint32_t>(tree_.pieces.size()) - leaf.first_piece;
    }

    std::uint32_t existing_slots(std::uint32_t node) const {
        std::uint32_t slots = 0;
        for (int slot = 0; slot < 4; ++slot) slots |= exists(reader_.reference(node, slot)) ? 1u << slot : 0u;
        return slots;
    }

    /// Breadth first from the root, as far as there is room.
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

    /// Fills tree_.nodes[index] with what is below the node.
    void expand(std::uint32_t index, std::uint32_t node, const Place& place) {
        if (triangles_below(node) <= sizes_.leaf_triangles) {
            fill_leaf(index, place, piece_of(place, node, existing_slots(node)));
            return;
        }
        const std::uint32_t small = small_slots(node);
        std::vector<int> large;
        for (int slot = 0; slot < 4; ++slot) {
            if (exists(reader_.reference(node, slot)) && (small >> slot & 1u) == 0) large.push_back(slot);
        }
        std::uint32_t child = static_cast<std::uint32_t>(tree_.nodes.size());
        tree_.nodes[index].first_child = child;
        tree_.nodes[index].child_count = static_cast<std::uint32_t>(large.size()) + (small != 0 ? 1u : 0u);
        tree_.nodes.resize(tree_.nodes.size() + tree_.nodes[index].child_count);
        for (std::uint32_t c = child; c < tree_.nodes.size(); ++c) tree_.nodes[c].parent = index;
        if (small != 0) fill_leaf(child++, place, piece_of(place, node, small));
        for (const int slot : large) {
            const std::uint32_t reference = reader_.reference(node, slot);
            const std::uint32_t below = reference & kBvhIndexMask;
            if (enters(reference)) {
                const std::uint32_t head = packed_.instance_head[below];
                tree_.spaces.push_back({below, node});
                expand(child++, head + kRoot,
                       {reader_.head(head), static_cast<std::uint32_t>(tree_.spaces.size() - 1)});
            } else if (is_instance(reference)) {
                fill_leaf(child++, place, piece_of(place, node, 1u << slot));
            } else {
                expand(child++, below, place);
            }
        }
    }

    const PackedScene& packed_;
    const TraceTables& tables_;
    CutSizes sizes_;
    PackedReader reader_;
    std::vector<std::size_t> below_;  // triangles, by node
    std::size_t entered_triangles_ = 0;
    CullTree tree_;
};

}  // namespace

CullTree build_cull_tree(const PackedScene& packed, const TraceTables& tables, const CutSizes& sizes) {
    CutSizes s = sizes;
    while (true) {
        CullTree tree = TreeBuilder(packed, tables, s).build();
        // Instances that are not entered are not divided: their number can be no smaller.
        if (tree.pieces.size() <= s.most_pieces || s.leaf_triangles >= packed.triangles.size()) return tree;
        s.piece_triangles *= 2;
        s.leaf_triangles *= 2;
    }
}

}  // namespace halflight::rays
