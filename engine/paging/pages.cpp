#include "engine/paging/pages.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>

#include "engine/rays/bvh.h"
#include "engine/rays/page_node.h"
#include "engine/rays/pair_texels.h"
#include "shaders/shared/bvh.h"

namespace halflight::paging {
namespace {

using rays::Bvh;
using rays::BvhChild;
using rays::BvhNode;
using shared::kBvhTag;

/// Content of a subtree.
struct Subtree {
    std::uint32_t nodes = 0;
    std::uint32_t pairs = 0;
    std::uint32_t alpha_tested = 0;  // triangles

    void add(const Subtree& s) { nodes += s.nodes, pairs += s.pairs, alpha_tested += s.alpha_tested; }
};

/// Cuts a hierarchy into pages.
class Cutter {
  public:
    Cutter(const Bvh& bvh, std::span<const rays::TrianglePair> pairs, std::span<const rays::Ring> rings,
           std::span<const std::uint32_t> ids, std::span<const bool> alpha, const PageLimits& limits)
        : bvh_(bvh), pairs_(pairs), rings_(rings), ids_(ids), alpha_(alpha), limits_(limits) {}

    PageSet cut() {
        set_.stack_entries = std::max(bvh_.stack_entries, 1u);
        if (bvh_.nodes.empty()) return std::move(set_);
        measure();
        Bounds all;
        for (const BvhChild& child : bvh_.nodes.front().children) all.add(child.bounds);
        descend(0, all);
        return std::move(set_);
    }

  private:
    /// Sets the content of each node's subtree. Nodes come depth first, so children have higher indices.
    void measure() {
        content_.resize(bvh_.nodes.size());
        for (std::size_t i = bvh_.nodes.size(); i-- > 0;) {
            Subtree s{1, 0};
            for (const BvhChild& child : bvh_.nodes[i].children) {
                if (child.bounds.empty()) continue;
                s.add(child.leaf() ? content_of(child) : content_[child.first]);
            }
            content_[i] = s;
        }
    }

    Subtree content_of(const BvhChild& leaf) const {
        Subtree s{0, leaf.count, 0};
        for (std::uint32_t i = leaf.first; i < leaf.first + leaf.count && !alpha_.empty(); ++i) {
            const auto& [a, b] = pairs_[bvh_.primitives[i]].triangles;
            s.alpha_tested += alpha_[a] + (b != a && alpha_[b]);
        }
        return s;
    }

    bool fits(const Subtree& s) const {
        return s.nodes <= limits_.nodes && s.pairs <= limits_.pairs && s.alpha_tested <= limits_.alpha_tested;
    }

    /// Puts the largest subtrees that fit into pages, depth first.
    void descend(std::uint32_t node, const Bounds& bounds) {
        if (fits(content_[node])) {
            add(node, bounds);
            return;
        }
        for (const BvhChild& child : bvh_.nodes[node].children) {
            if (child.bounds.empty()) continue;
            if (child.leaf())
                add_leaf(child);
            else
                descend(child.first, child.bounds);
        }
    }

    /// Returns the page that takes such a subtree: the last one, or a new one.
    Page& page_for(const Subtree& s, const Bounds& bounds) {
        last_.add(s);
        if (set_.pages.empty() || !fits(last_)) {
            set_.pages.emplace_back();
            last_ = s;
        }
        Page& page = set_.pages.back();
        set_.roots.push_back({bounds, static_cast<std::uint32_t>(set_.pages.size() - 1),
                              static_cast<std::uint32_t>(page.nodes.size() / shared::kBvhPageTexels)});
        return page;
    }

    void add(std::uint32_t node, const Bounds& bounds) {
        Page& page = page_for(content_[node], bounds);
        // Nodes of a subtree are consecutive, so their references shift by a constant.
        const auto shift = static_cast<std::uint32_t>(page.nodes.size() / shared::kBvhPageTexels) - node;
        for (std::uint32_t i = node; i < node + content_[node].nodes; ++i) {
            std::array<std::uint32_t, 4> references{};
            for (std::size_t k = 0; k < 4; ++k) {
                const BvhChild& child = bvh_.nodes[i].children[k];
                references[k] = child.bounds.empty() ? shared::kBvhNoChild
                                : child.leaf()       ? put_pairs(page, child)
                                                     : kBvhTag | (child.first + shift);
            }
            put_node(page, bvh_.nodes[i], references);
        }
    }

    /// Adds a leaf whose parent is too large for a page, below a node of its own.
    void add_leaf(const BvhChild& leaf) {
        Subtree content = content_of(leaf);
        content.nodes = 1;
        Page& page = page_for(content, leaf.bounds);
        BvhNode node;
        node.children[0] = leaf;
        const std::uint32_t none = shared::kBvhNoChild;
        put_node(page, node, {put_pairs(page, leaf), none, none, none});
    }

    static void put_node(Page& page, const BvhNode& node, const std::array<std::uint32_t, 4>& references) {
        const rays::PageNode texels = rays::encode_page_node(node, references);
        page.nodes.insert(page.nodes.end(), texels.begin(), texels.end());
    }

    std::uint32_t put_pairs(Page& page, const BvhChild& leaf) const {
        const auto first = static_cast<std::uint32_t>(page.pairs.size() / shared::kBvhPairTexels);
        for (std::uint32_t i = leaf.first; i < leaf.first + leaf.count; ++i) {
            const std::uint32_t primitive = bvh_.primitives[i];
            const auto texels = rays::pair_texels(rings_[primitive], pairs_[primitive], [&](std::uint32_t triangle) {
                return rays::PairMember{ids_[triangle], !alpha_.empty() && alpha_[triangle]};
            });
            page.pairs.insert(page.pairs.end(), texels.begin(), texels.end());
        }
        return kBvhTag | shared::kBvhLeaf | (leaf.count << shared::kBvhCountShift) | first;
    }

    const Bvh& bvh_;
    std::span<const rays::TrianglePair> pairs_;
    std::span<const rays::Ring> rings_;
    std::span<const std::uint32_t> ids_;
    std::span<const bool> alpha_;
    const PageLimits& limits_;
    std::vector<Subtree> content_;
    Subtree last_;  // content of the last page
    PageSet set_;
};

}  // namespace

rays::Bvh hierarchy_over(std::span<const PageRoot> roots) {
    std::vector<Bounds> boxes;
    boxes.reserve(roots.size());
    for (const PageRoot& root : roots) boxes.push_back(root.bounds);
    rays::Bvh bvh = rays::build_bvh(boxes);
    if (bvh.nodes.empty()) bvh.nodes.emplace_back();
    return bvh;
}

LoadedPage read_with_rows(const PageSource& source, std::uint32_t page) {
    LoadedPage loaded{source.read(page), {}};
    if (!source.index().alpha) return loaded;
    std::vector<std::uint32_t> triangles;
    std::vector<vec4>& pairs = loaded.page.pairs;
    for (std::size_t i = shared::kBvhPairTexels - 1; i < pairs.size(); i += shared::kBvhPairTexels) {
        uvec4 words = std::bit_cast<uvec4>(pairs[i]);
        words.w = kBvhTag | static_cast<std::uint32_t>(triangles.size());
        const bool single = words.x == words.y;
        for (int which = 0; which < (single ? 1 : 2); ++which)
            if ((words.z & (shared::kBvhAlphaTested << (which * shared::kBvhAlphaShift))) != 0)
                triangles.push_back(words[which] & shared::kBvhTriangleMask);
        pairs[i] = std::bit_cast<vec4>(words);
    }
    source.read_rows(triangles, loaded.rows);
    return loaded;
}

TraceTables resident_tables(const PageSource& source, const TraceTables* last) {
    const PageIndex& index = source.index();
    TraceTables tables;
    tables.origin = index.origin;
    tables.bounds = index.bounds;
    tables.ranges = index.ranges;
    tables.slivers = index.slivers;
    tables.alpha_tested = index.alpha;
    tables.absent = index.geometry;
    const std::vector<std::uint32_t>& emitters = index.geometry.emitters;
    std::vector<vec4>& attributes = tables.absent->attributes;
    std::uint32_t known = 0;  // emitters whose rows `last` has
    if (last) {
        known =
            static_cast<std::uint32_t>(std::ranges::lower_bound(emitters, source.still().triangles) - emitters.begin());
        const auto copy = [](const auto& from, std::size_t count, auto& to) {
            to.assign(from.begin(), from.begin() + static_cast<std::ptrdiff_t>(count));
        };
        copy(last->triangles, known, tables.triangles);
        copy(last->positions, 3 * std::size_t{known}, tables.positions);
        copy(last->absent->attributes, 3 * std::size_t{known} * index.vertex_texels, attributes);
    }
    TriangleRows rows;
    source.read_rows(std::span(emitters).subspan(known), rows);
    for (std::uint32_t i = known; i < emitters.size(); ++i)
        tables.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2, rows.triangles[i - known].w);
    tables.positions.insert(tables.positions.end(), rows.positions.begin(), rows.positions.end());
    attributes.insert(attributes.end(), rows.attributes.begin(), rows.attributes.end());
    if (index.triangles == 0) return tables;
    tables.blocks.push_back({.first_triangle = 0, .triangle_count = index.triangles, .bounds = index.bounds});
    tables.instances.push_back({.identity = true});
    return tables;
}

PageSet build_pages(std::span<const rays::Corners> triangles, std::span<const std::uint32_t> ids,
                    std::span<const bool> alpha, const PageLimits& limits) {
    assert(ids.size() == triangles.size() && (alpha.empty() || alpha.size() == triangles.size()));
    const std::vector<rays::TrianglePair> pairs = rays::pair_triangles(triangles);
    std::vector<rays::Ring> rings;
    rings.reserve(pairs.size());
    for (const rays::TrianglePair& pair : pairs) rings.push_back(rays::ring_of(pair, triangles));
    const Bvh bvh = rays::build_pair_bvh(rings, rays::Splits::none);
    return Cutter(bvh, pairs, rings, ids, alpha, limits).cut();
}

}  // namespace halflight::paging
