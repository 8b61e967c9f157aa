#include "engine/rays/hierarchies.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstring>
#include <iterator>
#include <optional>

#include "engine/core/stopwatch.h"
#include "engine/rays/refit.h"

namespace halflight::rays {
namespace {

std::vector<Corners> corners_of(const TraceTables& tables, const Part& part) {
    std::vector<Corners> corners;
    for (const std::uint32_t triangle : triangles_of(part)) {
        const uvec4& t = tables.triangles[triangle];
        corners.push_back({tables.positions[t.x], tables.positions[t.y], tables.positions[t.z]});
    }
    return corners;
}

PartTree build(const TraceTables& tables, const Part& part) {
    const std::vector<Corners> corners = corners_of(tables, part);
    PartTree tree;
    tree.pairs = pair_triangles(corners);
    tree.rings.reserve(tree.pairs.size());
    for (const TrianglePair& pair : tree.pairs) tree.rings.push_back(ring_of(pair, corners));
    tree.bvh = build_pair_bvh(tree.rings, part.moves ? Splits::none : Splits::allowed);
    if (part.moves) tree.cost = expected_cost(tree.bvh);
    return tree;
}

/// Returns whether the two triangles still share the edge.
bool holds_together(const TrianglePair& pair, const std::vector<Corners>& corners) {
    const auto one = corners_in_pair(pair, 0), other = corners_in_pair(pair, 1);
    const Corners &a = corners[pair.triangles[0]], &b = corners[pair.triangles[1]];
    return a[one[0]] == b[other[0]] && a[one[1]] == b[other[1]];
}

/// Returns a shape refitted to its triangles; none where it does not fit or would cost more than kMostRefitCost allows.
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

/// Returns whether two parts have equal triangles in equal places, and the same key where they move.
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

}  // namespace

std::vector<Part> parts_of(const TraceTables& tables) {
    std::vector<Part> parts;
    auto range = tables.ranges.begin();  // ranges are in the order of blocks
    for (std::uint32_t block = 0; block < tables.blocks.size(); ++block) {
        const std::uint32_t end = tables.blocks[block].first_triangle + tables.blocks[block].triangle_count;
        Part still{block, false, {}, {}};
        std::vector<Part> moving;
        std::uint32_t next = tables.blocks[block].first_triangle;
        const auto stand_still_until = [&](std::uint32_t triangle) {
            if (triangle > next) still.spans.push_back({next, triangle - next});
        };
        for (; range != tables.ranges.end() && range->block == block; ++range) {
            if (!range->moves) continue;
            stand_still_until(range->first_triangle);
            moving.push_back({block,
                              true,
                              {range->merged, range->merged ? range->instance : range->mesh},
                              {{range->first_triangle, range->triangle_count}}});
            next = range->first_triangle + range->triangle_count;
        }
        stand_still_until(end);
        if (!still.spans.empty()) parts.push_back(std::move(still));
        std::ranges::move(moving, std::back_inserter(parts));
    }
    return parts;
}

std::vector<std::uint32_t> triangles_of(const Part& part) {
    std::vector<std::uint32_t> triangles;
    for (const Part::Span& span : part.spans)
        for (std::uint32_t i = 0; i < span.count; ++i) triangles.push_back(span.first + i);
    return triangles;
}

Hierarchies::Hierarchies(const TraceTables& tables) : parts_(parts_of(tables)), trees_(parts_.size()) {
    const Stopwatch watch;
    tbb::parallel_for(std::size_t{0}, parts_.size(), [&](std::size_t i) { trees_[i] = build(tables, parts_[i]); });
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
    tree = build(now, part);
    return Fate::built;
}

void Hierarchies::update(const TraceTables& last, const TraceTables& now) {
    const Stopwatch watch;
    std::vector<Part> parts = parts_of(now);
    std::vector<PartTree> trees(parts.size());
    std::vector<Fate> fates(parts.size(), Fate::built);
    tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t i) {
        // Parts come in the same order unless something has appeared or vanished.
        if (i < parts_.size() && same_places(last, parts_[i], now, parts[i])) {
            trees[i] = std::move(trees_[i]);
            fates[i] = Fate::kept;
        } else {
            fates[i] = bring(now, parts[i], trees[i]);
        }
    });
    counts_ = {};
    for (const Fate fate : fates)
        ++(fate == Fate::kept ? counts_.kept : fate == Fate::refitted ? counts_.refitted : counts_.built);
    parts_ = std::move(parts);
    trees_ = std::move(trees);
    seconds_ = watch.seconds();
}

}  // namespace halflight::rays
