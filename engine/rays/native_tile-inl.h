// Search for any hits of a tile of up to 64 rays. Compiled once per instruction set.
//
// A node's children are tested against the chord shaft of the tile (native_bundle-inl.h). Those that meet it are tested
// against each vector of rays, so that an entry of the stack has the rays that meet its box. If at most kFewInTile
// rays meet an inner node, each goes on by itself, together with those that have left earlier tiles
// (native_open-inl.h). In scenes without instances, each vector first tests the leaf that ended rays in its place in an
// earlier run, if the tile met that leaf by itself.
#if defined(HALFLIGHT_NATIVE_TILE_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HALFLIGHT_NATIVE_TILE_INL
#undef HALFLIGHT_NATIVE_TILE_INL
#else
#define HALFLIGHT_NATIVE_TILE_INL
#endif

#include "engine/rays/native_bundle-inl.h"
#include "engine/rays/native_open-inl.h"

HWY_BEFORE_NAMESPACE();
namespace halflight::rays::HWY_NAMESPACE {

/// Greatest number of rays that leave a tile at an inner node, to go on by themselves.
inline constexpr int kFewInTile = 8;

/// An entry of the stack of a tile: a child of a node, and the rays that meet its box.
struct TileEntry {
    std::uint64_t rays;   // a bit per ray
    std::uint32_t place;  // 8 * node + slot
};

/// Returns the rays whose search has not ended, a bit each.
HWY_INLINE std::uint64_t searching(const Bundle& b) {
    return b.live & ~(b.found | b.out_of_range);
}
HWY_INLINE Bits of_vector(std::uint64_t rays, std::size_t vector) {
    return static_cast<Bits>(rays >> (vector * kLanes)) & ((1u << kLanes) - 1);
}

/// Rays of a tile that go on by themselves.
template <class Bound>
struct Leavers {
    OpenSearches<Bound, true>& open;
    StackEntry* stack;
    std::array<std::uint32_t, kBundle> place;  // of the open search; kNone: the ray has none

    HWY_INLINE Leavers(OpenSearches<Bound, true>& searches, StackEntry* single_stack)
        : open(searches), stack(single_stack) {
        place.fill(OpenSearches<Bound, true>::kNone);
        open.run(kBundle);
    }
    HWY_INLINE void visit(const NativeJob& job, Bundle& b, std::uint64_t rays, std::uint32_t reference) {
        for (; rays != 0; rays &= rays - 1) {
            const auto i = static_cast<std::size_t>(std::countr_zero(rays));
            if (place[i] == open.kNone) place[i] = open.open(single_ray(b, i), b.path[i], search_of(b, i));
            if (!open.visit(place[i], reference, 0))
                search_one<Bound, true>(job, b, i, reference, std::bit_cast<std::int32_t>(b.t_min[i]), stack);
        }
    }
};

/// Tests rays against the pairs of a leaf whose box they meet. Sets `blockers` of vectors with rays that end here.
HWY_INLINE void test_tile_leaf(const NativeJob& job, Bundle& b, std::uint64_t rays, std::uint32_t leaf,
                               std::uint32_t place, std::uint32_t* blockers) {
    for (std::size_t k = 0; k < kVectors; ++k) {
        const Bits lanes = of_vector(rays, k);
        if (lanes == 0) continue;
        const std::uint64_t found = b.found;
        test_leaf_lanes<true>(job, b, k, lanes, leaf, FN(0.0f));
        if (b.found != found) blockers[k] = place;
    }
}

/// Tests the rays of each vector against the leaf in `blockers`, which may be any number. With instances, most nodes
/// are in other spaces than the rays, and no leaf is kept.
template <class Bound>
HWY_INLINE void test_blockers(const NativeJob& job, Bundle& b, const std::uint32_t* blockers) {
    if (job.tree->two_level) return;
    const std::size_t count = node_count<Bound>(*job.tree);
    for (std::size_t k = 0; k < kVectors; ++k) {
        const std::uint32_t node_index = blockers[k] >> 3, child = blockers[k] & 7;
        const Bits left = of_vector(b.live, k);
        if (left == 0 || node_index >= count) continue;
        const NativeNode<Bound>& node = nodes_of<Bound>(*job.tree)[node_index];
        if (!shared::is_leaf(node.reference[child])) continue;
        FN entered;
        const Bits lanes = meet_box(b, k * kLanes, ChildBox(node, child), entered) & left;
        if (lanes != 0) test_leaf_lanes<true>(job, b, k, lanes, node.reference[child], FN(0.0f));
    }
}

/// Searches the scene for the rays of a tile.
template <class Bound>
void search_tile(const NativeJob& job, Bundle& b, const ShaftTest& shaft, std::uint32_t* blockers, TileEntry* stack,
                 Leavers<Bound>& leavers) {
    const NativeNode<Bound>* const nodes = nodes_of<Bound>(*job.tree);
    TileEntry* top = stack;
    const auto visit = [&](std::uint32_t index, std::uint64_t rays) HWY_ATTR {
        const NativeNode<Bound>& node = nodes[index];
        alignas(32) std::int32_t near[8];
        // Children are in the order of any hits. The first one is on top.
        for (Bits met = meet_shaft(node, shaft, 1.0f, near); met != 0;) {
            const auto child = static_cast<std::uint32_t>(31 - std::countl_zero(met));
            met ^= 1u << child;
            if (node.reference[child] == shared::kBvhNoChild) continue;
            const ChildBox box(node, child);
            std::uint64_t inside = 0;
            for (std::size_t k = 0; k < kVectors; ++k) {
                FN entered;
                if (of_vector(rays, k) != 0) inside |= bits_at(k, meet_box(b, k * kLanes, box, entered));
            }
            if ((inside & rays) != 0) *top++ = {inside & rays, index << 3 | child};
        }
    };
    visit(job.tree->spaces.front().root & shared::kBvhIndexMask, searching(b));
    while (top != stack) {
        const TileEntry entry = *--top;
        const std::uint64_t rays = entry.rays & searching(b);
        if (rays == 0) continue;
        const std::uint32_t reference = nodes[entry.place >> 3].reference[entry.place & 7];
        if (shared::is_leaf(reference)) {
            test_tile_leaf(job, b, rays, reference, entry.place, blockers);
        } else if (shared::is_inner_node(reference) && std::popcount(rays) > kFewInTile) {
            visit(reference & shared::kBvhIndexMask, rays);
        } else {
            leavers.visit(job, b, rays, reference);
        }
    }
}

/// Traces up to 64 rays together. `blockers` has a leaf for each vector of rays.
template <class Bound>
void trace_tile(const NativeJob& job, const std::uint32_t* paths, std::size_t count, std::uint32_t* blockers,
                TileEntry* stack, StackEntry* single_stack, OpenSearches<Bound, true>& open,
                std::vector<std::uint32_t>& delegated) {
    const NativeSpace& space = job.tree->spaces.front();
    Bundle b;
    set_rays(b, job, space, paths, count);
    test_blockers<Bound>(job, b, blockers);
    ShaftTest shaft;
    Leavers<Bound> leavers(open, single_stack);
    if (searching(b) != 0 && make_shaft(b, space, job.tree->format == NodeFormat::grid, shaft))
        search_tile<Bound>(job, b, shaft, blockers, stack, leavers);
    for (std::size_t i = 0; i < count; ++i) {
        if (leavers.place[i] == open.kNone)
            put(job, paths[i], search_of(b, i), delegated);
        else
            open.add(leavers.place[i], search_of(b, i));
    }
}

}  // namespace halflight::rays::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
