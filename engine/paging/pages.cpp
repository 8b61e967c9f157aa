#include "engine/paging/pages.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstring>
#include <utility>

#include "engine/core/error.h"
#include "engine/rays/bvh.h"
#include "engine/rays/page_node.h"
#include "engine/rays/pair_texels.h"
#include "engine/tables/table_rows.h"
#include "shaders/shared/bvh_nodes.h"

namespace halflight::paging {
namespace {

using rays::Bvh;
using rays::BvhChild;
using rays::BvhNode;
using shared::kBvhPageTexels;

constexpr std::size_t kTexel = sizeof(uvec4), kVertex = sizeof(vec3);
constexpr std::uint32_t kNone = ~0u;
/// Subtrees that take less than this share of a page are not cut to fill the page before.
constexpr std::uint32_t kSmallShare = 32;

/// Returns the place of the first vertex of a page in its slot, in vertices.
std::size_t first_vertex(const PageIndex::Size& size) {
    const std::size_t texels = std::size_t{size.nodes - size.roots} * kBvhPageTexels + size.pairs;
    return (texels * kTexel + kVertex - 1) / kVertex;
}

Bounds bounds_of(const BvhNode& node) {
    Bounds bounds;
    for (const BvhChild& child : node.children) bounds.add(child.bounds);
    return bounds;
}

bool alpha_tested(const uvec4& pair, int which) {
    return (pair[which] & shared::kBvhPageAlpha) != 0;
}
bool single(const uvec4& pair) {
    return ((pair.x ^ pair.y) & shared::kBvhTriangleMask) == 0;
}

/// Numbers of the corners of rings, equal if the bits of their positions are equal.
struct Corners {
    std::vector<std::array<std::uint32_t, 4>> of_ring;
    std::vector<vec3> positions;  // per number
};

Corners number_corners(std::span<const rays::Ring> rings) {
    using Bits = std::array<std::uint32_t, 3>;
    Corners corners;
    corners.of_ring.resize(rings.size());
    std::vector<std::uint32_t> table(std::bit_ceil(8 * rings.size() + 1), kNone);
    for (std::size_t i = 0; i < rings.size(); ++i) {
        for (std::size_t c = 0; c < 4; ++c) {
            const auto bits = std::bit_cast<Bits>(rings[i][c]);
            std::uint64_t hash = 0;
            for (const std::uint32_t word : bits) {
                hash = (hash ^ word) * 0x9e3779b97f4a7c15u;
                hash ^= hash >> 29;
            }
            std::size_t place = hash & (table.size() - 1);
            while (table[place] != kNone && std::bit_cast<Bits>(corners.positions[table[place]]) != bits)
                place = (place + 1) & (table.size() - 1);
            if (table[place] == kNone) {
                table[place] = static_cast<std::uint32_t>(corners.positions.size());
                corners.positions.push_back(rings[i][c]);
            }
            corners.of_ring[i][c] = table[place];
        }
    }
    return corners;
}

/// Size of a subtree.
struct Content {
    std::uint32_t nodes = 0;
    std::uint32_t pairs = 0;
    std::uint32_t alpha_tested = 0;   // triangles
    std::uint32_t stack_entries = 0;  // maximum stack of a traversal

    void add(const Content& s) {
        nodes += s.nodes, pairs += s.pairs, alpha_tested += s.alpha_tested;
        stack_entries = std::max(stack_entries, s.stack_entries);
    }
};

/// A subtree, as it is put into a page.
struct Subtree {
    std::span<const BvhNode> nodes;  // depth first
    std::uint32_t first = 0;         // index of the root in the hierarchy
    Bounds bounds;
    Content content;
    std::uint32_t parent = PageRoot::kNoParent;  // PageRoot::parent
};

/// Cuts a hierarchy into pages.
class Cutter {
  public:
    Cutter(const Bvh& bvh, std::span<const rays::TrianglePair> pairs, const Corners& corners,
           std::span<const std::uint32_t> ids, std::span<const std::uint32_t> words, const PageLimits& limits)
        : bvh_(bvh),
          pairs_(pairs),
          corners_(corners),
          ids_(ids),
          words_(words),
          limits_(limits),
          counted_at_(corners.positions.size(), 0),
          page_of_(corners.positions.size(), kNone),
          place_of_(corners.positions.size()) {}

    PageSet cut() {
        set_.stack_entries = 1;
        if (bvh_.nodes.empty()) return std::move(set_);
        measure();
        set_.pages.emplace_back();
        descend(0, bounds_of(bvh_.nodes.front()), PageRoot::kNoParent);
        return std::move(set_);
    }

  private:
    /// Sets the content of each node's subtree. Nodes come depth first, so children have higher indices.
    void measure() {
        content_.resize(bvh_.nodes.size());
        for (std::size_t i = bvh_.nodes.size(); i-- > 0;) {
            Content s{1};
            for (const BvhChild& child : bvh_.nodes[i].children)
                if (!child.bounds.empty()) s.add(child.leaf() ? content_of(child) : content_[child.first]);
            s.stack_entries += static_cast<std::uint32_t>(bvh_.nodes[i].child_count()) - 1;
            content_[i] = s;
        }
    }

    Content content_of(const BvhChild& leaf) const {
        Content s{0, leaf.count};
        for (std::uint32_t i = leaf.first; i < leaf.first + leaf.count && !words_.empty(); ++i) {
            const auto& [a, b] = pairs_[bvh_.primitives[i]].triangles;
            s.alpha_tested += is_tested(a) + (b != a && is_tested(b));
        }
        return s;
    }

    bool is_tested(std::uint32_t triangle) const { return (words_[triangle] & kTriangleAlpha) != 0; }

    /// Returns whether the last page has room for a subtree.
    bool fits(const Subtree& subtree) {
        const Page& to = set_.pages.back();
        Content all = last_;
        all.add(subtree.content);
        PageIndex::Size size{all.nodes, to.roots + 1, all.pairs, static_cast<std::uint32_t>(to.vertices.size())};
        if (all.alpha_tested > limits_.alpha_tested || bytes_in_slot(size) > limits_.bytes) return false;
        ++counts_;
        for (const BvhNode& node : subtree.nodes) {
            for (const BvhChild& child : node.children) {
                for (std::uint32_t i = child.first; i < child.first + child.count; ++i) {
                    for (const std::uint32_t corner : corners_.of_ring[bvh_.primitives[i]]) {
                        if (page_of_[corner] == page() || counted_at_[corner] == counts_) continue;
                        counted_at_[corner] = counts_;
                        ++size.vertices;
                    }
                }
            }
        }
        return bytes_in_slot(size) <= limits_.bytes;
    }

    /// Returns whether a subtree goes to the next page as a whole. It fits into an empty page.
    bool small(const Content& s) const {
        return kSmallShare * bytes_in_slot({s.nodes, 1, s.pairs, 4 * s.pairs}) <= limits_.bytes &&
               kSmallShare * s.alpha_tested <= limits_.alpha_tested;
    }

    std::uint32_t page() const { return static_cast<std::uint32_t>(set_.pages.size() - 1); }

    void start_page() {
        set_.pages.emplace_back();
        last_ = {};
    }

    /// Puts the largest subtrees that fit into pages, depth first.
    void descend(std::uint32_t node, const Bounds& bounds, std::uint32_t parent) {
        const Content& content = content_[node];
        const Subtree subtree{std::span(bvh_.nodes).subspan(node, content.nodes), node, bounds, content, parent};
        const bool fits_into_last = fits(subtree);
        if (fits_into_last || small(content)) {
            if (!fits_into_last) start_page();
            add(subtree);
            return;
        }
        const auto above = static_cast<std::uint32_t>(set_.above.size());
        set_.above.push_back(parent);
        for (const BvhChild& child : bvh_.nodes[node].children) {
            if (child.bounds.empty()) continue;
            if (child.leaf())
                add_leaf(child, above);
            else
                descend(child.first, child.bounds, above);
        }
    }

    /// Adds a leaf whose parent does not fit, below a node of its own.
    void add_leaf(const BvhChild& leaf, std::uint32_t parent) {
        BvhNode node;
        node.children[0] = leaf;
        Subtree subtree{std::span(&node, 1), 0, leaf.bounds, content_of(leaf), parent};
        subtree.content.nodes = 1;
        if (!fits(subtree)) start_page();
        add(subtree);
    }

    void add(const Subtree& subtree) {
        Page& to = set_.pages.back();
        last_.add(subtree.content);
        ++to.roots;
        set_.roots.push_back({subtree.bounds, page(), subtree.parent});
        set_.stack_entries = std::max(set_.stack_entries, subtree.content.stack_entries);
        std::vector<std::uint32_t> order{0};  // nodes of the subtree, breadth first
        for (std::size_t i = 0; i < order.size(); ++i) {
            const BvhNode& node = subtree.nodes[order[i]];
            const rays::PageNode texels = rays::encode_page_node(node);
            to.nodes.insert(to.nodes.end(), texels.begin(), texels.end());
            for (const BvhChild& child : node.children) {
                if (child.bounds.empty()) continue;
                if (child.leaf())
                    put_pairs(to, child);
                else
                    order.push_back(child.first - subtree.first);
            }
        }
    }

    void put_pairs(Page& to, const BvhChild& leaf) {
        for (std::uint32_t i = leaf.first; i < leaf.first + leaf.count; ++i) {
            const std::uint32_t primitive = bvh_.primitives[i];
            std::array<std::uint32_t, 4> places{};
            for (std::size_t c = 0; c < 4; ++c) {
                const std::uint32_t corner = corners_.of_ring[primitive][c];
                if (std::exchange(page_of_[corner], page()) != page()) {
                    place_of_[corner] = static_cast<std::uint32_t>(to.vertices.size());
                    to.vertices.push_back(corners_.positions[corner]);
                }
                places[c] = place_of_[corner];
            }
            to.pairs.push_back(rays::page_pair(places, pairs_[primitive], [&](std::uint32_t triangle) {
                return rays::PairMember{ids_[triangle], words_.empty() ? 0 : words_[triangle]};
            }));
        }
    }

    const Bvh& bvh_;
    std::span<const rays::TrianglePair> pairs_;
    const Corners& corners_;
    std::span<const std::uint32_t> ids_;
    std::span<const std::uint32_t> words_;
    const PageLimits& limits_;
    std::vector<Content> content_;
    Content last_;  // content of the last page
    // Per corner:
    std::vector<std::uint64_t> counted_at_;  // call of fits() that counted it last
    std::vector<std::uint32_t> page_of_;     // last page that has it
    std::vector<std::uint32_t> place_of_;    // number of the corner's vertex in that page
    std::uint64_t counts_ = 0;               // calls of fits()
    PageSet set_;
};

/// Puts the nodes and pairs of a page into the order of slots, and sets distances and corners.
class Placing {
  public:
    Placing(const Page& page, LoadedPage& to)
        : page_(page), to_(to), first_vertex_(static_cast<std::uint32_t>(first_vertex(size_of(page)))) {}

    /// Returns whether every reference leads to something in the page.
    bool place() {
        const std::size_t count = page_.nodes.size() / kBvhPageTexels, vertices = page_.vertices.size();
        to_.texels.resize((first_vertex_ * kVertex + vertices * kVertex + kTexel - 1) / kTexel);
        for (std::size_t i = 0; i < count; ++i) {
            rays::PageNode node;
            std::copy_n(&page_.nodes[i * kBvhPageTexels], kBvhPageTexels, node.begin());
            if (i == places_.size()) {
                places_.push_back({0, kNone});
                rays::distance_of(node) = end_;
                to_.roots.push_back(node);
            } else {
                rays::distance_of(node) = end_ - places_[i].texel;
                std::ranges::copy(node, &to_.texels[places_[i].texel]);
            }
            if (!place_below(node, static_cast<std::uint32_t>(i))) return false;
        }
        if (vertices > 0)
            std::memcpy(reinterpret_cast<char*>(to_.texels.data()) + first_vertex_ * kVertex, page_.vertices.data(),
                        vertices * kVertex);
        return pair_texels_.size() == page_.pairs.size() && to_.roots.size() == page_.roots;
    }

    /// Returns the maximum stack of a traversal of the page, entries. Nodes come after those above them.
    std::uint32_t stack_entries() const {
        std::uint32_t most = 0;
        std::vector<std::uint32_t> below(places_.size(), 0);
        for (std::size_t i = places_.size(); i-- > 0;) {
            const std::uint32_t entries = below[i] + std::max(places_[i].children, 1u) - 1;
            std::uint32_t& above = places_[i].parent == kNone ? most : below[places_[i].parent];
            above = std::max(above, entries);
        }
        return most;
    }

    /// Sets the rows of the page.
    void add_rows(const PageSource& source) {
        std::vector<std::uint32_t> triangles;
        to_.first_rows.resize(end_);
        for (std::size_t i = 0; i < pair_texels_.size(); ++i) {
            const uvec4& pair = page_.pairs[i];
            to_.first_rows[pair_texels_[i]] = static_cast<std::uint16_t>(triangles.size());
            for (int which = 0; which < (single(pair) ? 1 : 2); ++which)
                if (alpha_tested(pair, which)) triangles.push_back(pair[which] & shared::kBvhTriangleMask);
        }
        source.read_rows(triangles, to_.rows);
    }

  private:
    /// A node of the page.
    struct Place {
        std::uint32_t texel;         // not used for roots
        std::uint32_t parent;        // index of the node above it; kNone: a root
        std::uint32_t children = 0;  // number of children, leaves included
    };

    bool place_below(const rays::PageNode& node, std::uint32_t index) {
        const std::uint32_t first = end_;
        for (const bool leaves : {false, true}) {
            for (int k = 0; k < 4; ++k) {
                const rays::PageChild child = rays::page_child(node, k);
                if (!child.exists || (child.pairs > 0) != leaves) continue;
                if (child.offset != end_ - first) return false;
                ++places_[index].children;
                if (!leaves && !place_node(index)) return false;
                for (std::uint32_t i = 0; i < child.pairs; ++i)
                    if (!place_pair()) return false;
            }
        }
        return true;
    }

    bool place_node(std::uint32_t parent) {
        // All nodes but the roots take texels.
        if (places_.size() - to_.roots.size() + page_.roots == page_.nodes.size() / kBvhPageTexels) return false;
        places_.push_back({end_, parent});
        end_ += kBvhPageTexels;
        return true;
    }

    bool place_pair() {
        if (pair_texels_.size() == page_.pairs.size()) return false;
        uvec4 pair = page_.pairs[pair_texels_.size()];
        for (int word = 2; word < 4; ++word) {
            for (const int shift : {0, shared::kBvhPageCornerBits})
                if (((pair[word] >> shift) & shared::kBvhPageCornerMask) >= page_.vertices.size()) return false;
            pair[word] += first_vertex_ | (first_vertex_ << shared::kBvhPageCornerBits);
        }
        pair_texels_.push_back(end_);
        to_.texels[end_++] = pair;
        return true;
    }

    const Page& page_;
    LoadedPage& to_;
    const std::uint32_t first_vertex_;
    std::vector<Place> places_;               // places of the nodes so far
    std::vector<std::uint32_t> pair_texels_;  // texels of the pairs so far
    std::uint32_t end_ = 0;                   // texels so far
};

/// Returns whether all triangles are below a limit.
bool has_triangles_below(const Page& page, std::uint32_t limit) {
    return std::ranges::all_of(page.pairs, [&](const uvec4& pair) {
        return std::max(pair.x & shared::kBvhTriangleMask, pair.y & shared::kBvhTriangleMask) < limit;
    });
}

/// Returns the number of triangles with alpha tests.
std::size_t alpha_tested_in(const Page& page) {
    std::size_t count = 0;
    for (const uvec4& pair : page.pairs) count += alpha_tested(pair, 0) + (!single(pair) && alpha_tested(pair, 1));
    return count;
}

}  // namespace

void append_above(std::vector<std::uint32_t>& above, PageSet& set) {
    const auto shift = static_cast<std::uint32_t>(above.size());
    const auto shifted = [&](std::uint32_t parent) { return parent == PageRoot::kNoParent ? parent : parent + shift; };
    for (const std::uint32_t parent : set.above) above.push_back(shifted(parent));
    for (PageRoot& root : set.roots) root.parent = shifted(root.parent);
}

rays::Bvh hierarchy_over(const PageIndex& index) {
    // Children of nodes have indices into `nodes`, or roots and a count of 1.
    std::vector<BvhNode> nodes(index.above.size());
    std::vector<BvhChild> without_parent;
    const auto add = [&](std::uint32_t parent, const BvhChild& child) {
        if (parent == PageRoot::kNoParent)
            without_parent.push_back(child);
        else
            *std::ranges::find_if(nodes[parent].children, [](const BvhChild& c) { return c.bounds.empty(); }) = child;
    };
    for (std::uint32_t root = 0; root < index.roots.size(); ++root)
        add(index.roots[root].parent, {index.roots[root].bounds, root, 1});
    for (auto i = static_cast<std::uint32_t>(nodes.size()); i-- > 0;) add(index.above[i], {bounds_of(nodes[i]), i, 0});

    std::vector<Bounds> boxes;
    for (const BvhChild& child : without_parent) boxes.push_back(child.bounds);
    const Bvh over = rays::build_bvh(boxes);
    const auto first = static_cast<std::uint32_t>(nodes.size());
    for (BvhNode node : over.nodes) {
        for (BvhChild& child : node.children) {
            if (child.leaf())
                child = without_parent[over.primitives[child.first]];
            else
                child.first += first;
        }
        nodes.push_back(node);
    }
    if (over.nodes.empty()) nodes.emplace_back();

    Bvh bvh;
    const auto add_from = [&](const auto& self, std::uint32_t from) -> std::uint32_t {
        BvhNode node = nodes[from];
        const std::size_t place = bvh.nodes.size();
        bvh.nodes.emplace_back();
        std::uint32_t deepest = 0;
        for (BvhChild& child : node.children) {
            if (child.bounds.empty()) continue;
            if (child.leaf()) {
                bvh.primitives.push_back(std::exchange(child.first, static_cast<std::uint32_t>(bvh.primitives.size())));
            } else {
                const std::uint32_t below = std::exchange(child.first, static_cast<std::uint32_t>(bvh.nodes.size()));
                deepest = std::max(deepest, self(self, below));
            }
        }
        bvh.nodes[place] = node;
        return deepest + static_cast<std::uint32_t>(std::max(node.child_count(), 1)) - 1;
    };
    bvh.stack_entries = add_from(add_from, first);
    return bvh;
}

SceneNeeds vertex_layout(const PageIndex& index) {
    SceneNeeds needs;
    needs.vertex_colors = index.geometry.vertex_colors;
    const std::uint32_t others = index.vertex_texels - (needs.vertex_colors ? 2 : 1);
    needs.texture_coordinates = others >= 1;
    needs.normal_maps = others >= 2;  // normal maps need texture coordinates (vertex.h)
    return needs;
}

bool within_reach(const vec3& position) {
    return glm::all(glm::lessThanEqual(glm::abs(position), vec3(kSceneReach)));
}

PageIndex::Size size_of(const Page& page) {
    return {static_cast<std::uint32_t>(page.nodes.size() / kBvhPageTexels), page.roots,
            static_cast<std::uint32_t>(page.pairs.size()), static_cast<std::uint32_t>(page.vertices.size())};
}

std::size_t bytes_in_slot(const PageIndex::Size& size) {
    return (first_vertex(size) + size.vertices) * kVertex;
}

bool append(RootedPage& to, const RootedPage& page, const PageLimits& limits) {
    PageIndex::Size size = size_of(to.page);
    const PageIndex::Size more = size_of(page.page);
    const auto shift = size.vertices;
    size.nodes += more.nodes, size.roots += more.roots, size.pairs += more.pairs, size.vertices += more.vertices;
    if (bytes_in_slot(size) > limits.bytes ||
        alpha_tested_in(to.page) + alpha_tested_in(page.page) > limits.alpha_tested)
        return false;
    to.page.roots = size.roots;
    to.page.nodes.insert(to.page.nodes.end(), page.page.nodes.begin(), page.page.nodes.end());
    to.page.vertices.insert(to.page.vertices.end(), page.page.vertices.begin(), page.page.vertices.end());
    for (uvec4 pair : page.page.pairs) {
        for (int word = 2; word < 4; ++word) pair[word] += shift | (shift << shared::kBvhPageCornerBits);
        to.page.pairs.push_back(pair);
    }
    to.roots.insert(to.roots.end(), page.roots.begin(), page.roots.end());
    return true;
}

LoadedPage read_with_rows(const PageSource& source, std::uint32_t page) {
    const Page content = source.read(page);
    const PageIndex& index = source.index();
    const StillPart still = source.still();
    const auto check = [&](bool holds, const char* defect) {
        if (!holds) throw Error(source.subject(), "page {} {}", page, defect);
    };
    check(bytes_in_slot(size_of(content)) <= index.limits.bytes &&
              (!index.alpha || alpha_tested_in(content) <= index.limits.alpha_tested),
          "is larger than the limits of the scene");
    check(std::ranges::all_of(content.vertices, within_reach), "has a position that no scene has");
    check(has_triangles_below(content, page < still.pages ? still.triangles : index.triangles),
          "has a triangle that the scene lacks");
    LoadedPage loaded;
    Placing placing(content, loaded);
    check(placing.place(), "has a node that leads out of it");
    check(placing.stack_entries() <= index.stack_entries, "is deeper than the index states");
    if (index.alpha) placing.add_rows(source);
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
    tables.one_sided = index.one_sided;
    tables.panes = index.panes;
    tables.absent = index.geometry;
    const std::vector<std::uint32_t>& resident = index.geometry.resident;
    std::vector<vec4>& attributes = tables.absent->attributes;
    std::uint32_t known = 0;  // resident triangles whose rows `last` has
    if (last) {
        known =
            static_cast<std::uint32_t>(std::ranges::lower_bound(resident, source.still().triangles) - resident.begin());
        const auto copy = [](const auto& from, std::size_t count, auto& to) {
            to.assign(from.begin(), from.begin() + static_cast<std::ptrdiff_t>(count));
        };
        copy(last->triangles, known, tables.triangles);
        copy(last->positions, 3 * std::size_t{known}, tables.positions);
        copy(last->absent->attributes, 3 * std::size_t{known} * index.vertex_texels, attributes);
    }
    TriangleRows rows;
    source.read_rows(std::span(resident).subspan(known), rows);
    for (std::uint32_t i = known; i < resident.size(); ++i)
        tables.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2, rows.triangles[i - known].w);
    tables.positions.insert(tables.positions.end(), rows.positions.begin(), rows.positions.end());
    attributes.insert(attributes.end(), rows.attributes.begin(), rows.attributes.end());
    if (index.triangles == 0) return tables;
    tables.blocks.push_back({.first_triangle = 0, .triangle_count = index.triangles, .bounds = index.bounds});
    tables.instances.push_back({.identity = true});
    return tables;
}

PageSet build_pages(std::span<const rays::Corners> triangles, std::span<const std::uint32_t> ids,
                    std::span<const std::uint32_t> words, const PageLimits& limits) {
    assert(ids.size() == triangles.size() && (words.empty() || words.size() == triangles.size()));
    const std::vector<rays::TrianglePair> pairs = rays::pair_triangles(triangles, words);
    std::vector<rays::Ring> rings;
    rings.reserve(pairs.size());
    for (const rays::TrianglePair& pair : pairs) rings.push_back(rays::ring_of(pair, triangles));
    const Bvh bvh = rays::build_pair_bvh(rings, rays::Splits::none);
    return Cutter(bvh, pairs, number_corners(rings), ids, words, limits).cut();
}

}  // namespace halflight::paging
