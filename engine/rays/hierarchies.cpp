#include "engine/rays/hierarchies.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstring>
#include <iterator>
#include <optional>
#include <span>

#include "engine/core/release.h"
#include "engine/core/stopwatch.h"
#include "engine/rays/refit.h"

namespace halflight::rays {
namespace {

std::vector<Corners> corners_of(const TraceTables& tables, const Part& part) {
    const std::vector<std::uint32_t> triangles = triangles_of(part);
    std::vector<Corners> corners;
    corners.reserve(triangles.size());
    for (const std::uint32_t triangle : triangles) {
        const uvec4& t = tables.triangles[triangle];
        corners.push_back({tables.positions[t.x], tables.positions[t.y], tables.positions[t.z]});
    }
    return corners;
}

/// Returns whether the two triangles still share the edge.
bool holds_together(const TrianglePair& pair, const std::vector<Corners>& corners) {
    const auto one = corners_in_pair(pair, 0), other = corners_in_pair(pair, 1);
    const Corners &a = corners[pair.triangles[0]], &b = corners[pair.triangles[1]];
    return a[one[0]] == b[other[0]] && a[one[1]] == b[other[1]];
}

/// Returns a shape refitted to its triangles; none if it does not fit or would cost more than kMostRefitCost allows.
std::optional<PartTree> refitted(const PartTree& shape, const TraceTables& tables, const Part& part) {
    const std::vector<Corners> corners = corners_of(tables, part);
    std::size_t triangles = 0;
    for (const TrianglePair& pair : shape.pairs) triangles += pair.triangles[0] == pair.triangles[1] ? 1 : 2;
    if (triangles != corners.size()) return std::nullopt;
    const auto whole = [&](const TrianglePair& pair) { return holds_together(pair, corners); };
    if (!std::ranges::all_of(shape.pairs, whole)) return std::nullopt;
    PartTree tree = shape;
    for (std::size_t i = 0; i < tree.pairs.size(); ++i) tree.rings[i] = ring_of(tree.pairs[i], corners);
    refit(tree.bvh, tree.rings);
    if (expected_cost(tree.bvh) > kMostRefitCost * shape.cost) return std::nullopt;
    return tree;
}

/// Compares all bits, because signs of zeros can change hits.
bool same_bits(const vec3& a, const vec3& b) {
    return std::memcmp(&a, &b, sizeof(a)) == 0;
}

/// Returns whether two parts have equal triangles in equal places, and the same key if they move.
bool same_places(const TraceTables& a, const Part& pa, const TraceTables& b, const Part& pb) {
    if (pa.moves != pb.moves || pa.key != pb.key) return false;
    const std::vector<std::uint32_t> ta = triangles_of(pa), tb = triangles_of(pb);
    const auto same = [&](std::uint32_t x, std::uint32_t y) {
        const uvec4 &tx = a.triangles[x], &ty = b.triangles[y];
        return same_bits(a.positions[tx.x], b.positions[ty.x]) && same_bits(a.positions[tx.y], b.positions[ty.y]) &&
               same_bits(a.positions[tx.z], b.positions[ty.z]);
    };
    return std::ranges::equal(ta, tb, same);
}

std::size_t count_of(const Part& part) {
    std::size_t count = 0;
    for (const Part::Span& span : part.spans) count += span.count;
    return count;
}

struct Centred {
    vec3 centre;  // twice the centre of the triangle's box
    std::uint32_t triangle;
};

/// Appends a part of these triangles, or halves of it with at most `most` triangles. Changes the order of `triangles`.
void add_cut(std::uint32_t block, std::span<Centred> triangles, std::size_t most, std::vector<Part>& parts) {
    if (triangles.size() > most) {
        Bounds centres;
        for (const Centred& t : triangles) centres.add(t.centre);
        const vec3 extent = centres.extent();
        const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
        const auto before = [axis](const Centred& a, const Centred& b) {  // a total order makes the halves unique
            return std::pair(a.centre[axis], a.triangle) < std::pair(b.centre[axis], b.triangle);
        };
        const std::size_t half = triangles.size() / 2;
        std::ranges::nth_element(triangles, triangles.begin() + static_cast<std::ptrdiff_t>(half), before);
        add_cut(block, triangles.first(half), most, parts);
        add_cut(block, triangles.subspan(half), most, parts);
        return;
    }
    std::ranges::sort(triangles, {}, &Centred::triangle);
    Part part{.block = block, .cut = true};
    for (const Centred& t : triangles) {
        if (part.spans.empty() || part.spans.back().first + part.spans.back().count != t.triangle)
            part.spans.push_back({t.triangle, 0});
        ++part.spans.back().count;
    }
    parts.push_back(std::move(part));
}

}  // namespace

std::vector<Part> parts_of(const TraceTables& tables) {
    std::vector<Part> parts;
    auto range = tables.ranges.begin();  // ranges are in the order of blocks
    for (std::uint32_t block = 0; block < tables.blocks.size(); ++block) {
        const std::uint32_t end = tables.blocks[block].first_triangle + tables.blocks[block].triangle_count;
        Part still{.block = block};
        std::vector<Part> moving;
        std::uint32_t next = tables.blocks[block].first_triangle;
        const auto stand_still_until = [&](std::uint32_t triangle) {
            if (triangle > next) still.spans.push_back({next, triangle - next});
        };
        for (; range != tables.ranges.end() && range->block == block; ++range) {
            if (!range->moves) continue;
            stand_still_until(range->first_triangle);
            moving.push_back({.block = block,
                              .moves = true,
                              .key = {range->merged, range->merged ? range->instance : range->mesh},
                              .spans = {{range->first_triangle, range->triangle_count}}});
            next = range->first_triangle + range->triangle_count;
        }
        stand_still_until(end);
        if (!still.spans.empty()) parts.push_back(std::move(still));
        std::ranges::move(moving, std::back_inserter(parts));
    }
    return parts;
}

std::vector<Part> cut(const TraceTables& tables, Part part, std::size_t most) {
    std::vector<Part> parts;
    if (part.moves || count_of(part) <= most) {
        parts.push_back(std::move(part));
        return parts;
    }
    std::vector<Centred> triangles;
    triangles.reserve(count_of(part));
    for (const std::uint32_t triangle : triangles_of(part)) {
        const uvec4& t = tables.triangles[triangle];
        const vec3 &a = tables.positions[t.x], &b = tables.positions[t.y], &c = tables.positions[t.z];
        triangles.push_back({glm::min(a, glm::min(b, c)) + glm::max(a, glm::max(b, c)), triangle});
    }
    add_cut(part.block, triangles, most, parts);
    return parts;
}

std::vector<std::uint32_t> triangles_of(const Part& part) {
    std::vector<std::uint32_t> triangles;
    triangles.reserve(count_of(part));
    for (const Part::Span& span : part.spans)
        for (std::uint32_t i = 0; i < span.count; ++i) triangles.push_back(span.first + i);
    return triangles;
}

std::vector<Part> pane_parts_of(const TraceTables& tables) {
    std::vector<Part> parts;
    for (std::uint32_t block = 0; block < tables.blocks.size(); ++block) {
        const Block& b = tables.blocks[block];
        // Panes are few. Their tree is built anew for each pose, and its triangles are not split.
        Part part{.block = block, .cut = true};
        // Triangles whose geometry is not in memory have no row.
        const std::size_t end = std::min<std::size_t>(b.first_triangle + b.triangle_count, tables.triangles.size());
        for (std::uint32_t t = b.first_triangle; t < end; ++t) {
            if (!shared::in_pane(tables.triangles[t].w)) continue;
            if (part.spans.empty() || part.spans.back().first + part.spans.back().count != t)
                part.spans.push_back({t, 0});
            ++part.spans.back().count;
        }
        if (!part.spans.empty()) parts.push_back(std::move(part));
    }
    return parts;
}

PartTree build_tree(const TraceTables& tables, const Part& part) {
    std::vector<Corners> corners = corners_of(tables, part);
    PartTree tree;
    tree.pairs = pair_triangles(corners);
    tree.pairs.shrink_to_fit();
    tree.rings.reserve(tree.pairs.size());
    for (const TrianglePair& pair : tree.pairs) tree.rings.push_back(ring_of(pair, corners));
    release(corners);  // Embree needs the memory
    tree.bvh = build_pair_bvh(tree.rings, part.moves || part.cut ? Splits::none : Splits::allowed);
    if (part.moves) tree.cost = expected_cost(tree.bvh);
    return tree;
}

Hierarchies::Hierarchies(const TraceTables& tables, std::size_t most_in_part)
    : most_in_part_(most_in_part), whole_(parts_of(tables)) {
    const Stopwatch watch;
    for (const Part& whole : whole_) {
        std::ranges::move(cut(tables, whole, most_in_part_), std::back_inserter(parts_));
        ends_.push_back(parts_.size());
    }
    trees_.resize(parts_.size());
    tbb::parallel_for(std::size_t{0}, parts_.size(), [&](std::size_t i) { trees_[i] = build_tree(tables, parts_[i]); });
    for (std::size_t i = 0; i < parts_.size(); ++i)
        if (parts_[i].moves) shapes_[parts_[i].key] = trees_[i];
    counts_.built = parts_.size();
    seconds_ = watch.seconds();
}

Hierarchies::Fate Hierarchies::bring(const TraceTables& now, const Part& part, PartTree& tree) const {
    if (part.moves) {
        const auto shape = shapes_.find(part.key);
        if (shape != shapes_.end()) {
            if (auto fits = refitted(shape->second, now, part)) {
                tree = std::move(*fits);
                return Fate::refitted;
            }
        }
    }
    tree = build_tree(now, part);
    return Fate::built;
}

void Hierarchies::update(const TraceTables& last, const TraceTables& now) {
    const Stopwatch watch;
    std::vector<Part> whole = parts_of(now), parts;
    // Parts come in the same order unless something has appeared or vanished.
    std::vector<char> same(whole.size());
    tbb::parallel_for(std::size_t{0}, whole.size(), [&](std::size_t i) {
        same[i] = i < whole_.size() && same_places(last, whole_[i], now, whole[i]);
    });
    std::vector<std::size_t> ends;
    std::vector<PartTree> trees;
    std::vector<Fate> fates;
    for (std::size_t i = 0; i < whole.size(); ++i) {
        const auto begin = static_cast<std::ptrdiff_t>(i == 0 || !same[i] ? 0 : ends_[i - 1]);
        const auto end = static_cast<std::ptrdiff_t>(same[i] ? ends_[i] : 0);
        std::move(trees_.begin() + begin, trees_.begin() + end, std::back_inserter(trees));
        // Equal geometry is cut at equal planes. Its parts are reused only if its triangles have the same indices, too.
        if (same[i] && whole[i].spans == whole_[i].spans)
            std::move(parts_.begin() + begin, parts_.begin() + end, std::back_inserter(parts));
        else
            std::ranges::move(cut(now, whole[i], most_in_part_), std::back_inserter(parts));
        trees.resize(parts.size());
        fates.resize(parts.size(), same[i] ? Fate::kept : Fate::built);
        ends.push_back(parts.size());
    }
    tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t i) {
        if (fates[i] != Fate::kept) fates[i] = bring(now, parts[i], trees[i]);
    });
    counts_ = {};
    for (const Fate fate : fates)
        ++(fate == Fate::kept ? counts_.kept : fate == Fate::refitted ? counts_.refitted : counts_.built);
    whole_ = std::move(whole);
    ends_ = std::move(ends);
    parts_ = std::move(parts);
    trees_ = std::move(trees);
    seconds_ = watch.seconds();
}

}  // namespace halflight::rays
