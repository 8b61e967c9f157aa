// Searches of many rays in turns. Compiled once per instruction set.
//
// A ray that goes through a hierarchy alone waits: for a node, for the tests of its children, and for branches that the
// processor cannot predict. Here up to kOpen rays are searched at once, as in Barringer and Akenine-Moeller 2014,
// Dynamic Ray Stream Traversal. A round visits one node for each ray, then tests all leaves that were met. The work of
// a ray does not depend on that of its neighbours, so the processor overlaps it. Children go to the stack of their ray
// by a vector compression, without a branch (Fuetterling, Lojewski, Pfreundt, Hamann 2017, Accelerated Single Ray
// Tracing for Wide Vector Units). The order of rays changes no hit, because ties are broken by ids.
#if defined(HALFLIGHT_NATIVE_OPEN_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HALFLIGHT_NATIVE_OPEN_INL
#undef HALFLIGHT_NATIVE_OPEN_INL
#else
#define HALFLIGHT_NATIVE_OPEN_INL
#endif

#include <hwy/cache_control.h>

#include "engine/rays/native_single-inl.h"

HWY_BEFORE_NAMESPACE();
namespace halflight::rays::HWY_NAMESPACE {

/// Rays that are searched at once if all go alone. Their constants and stacks fit the first cache of a core.
inline constexpr std::size_t kOpenAlone = 64;

using I8D = hn::FixedTag<std::int32_t, 8>;

/// Sorts keys, the greatest one first (a bitonic network: Batcher 1968).
HWY_INLINE I8 sorted(I8 v) {
    const I8D d;
    // Exchanges lanes with their partners; lanes of `low` keep the lesser key.
    const auto exchange = [&](I8 partner, std::uint8_t low) HWY_ATTR {
        const auto keeps_low = hn::LoadMaskBits(d, &low);
        v = hn::IfThenElse(keeps_low, hn::Min(v, partner), hn::Max(v, partner));
    };
    const auto swap_within = [&](const std::int32_t* places)
                                 HWY_ATTR { return hn::TableLookupLanes(v, hn::SetTableIndices(d, places)); };
    static constexpr std::int32_t kFold[8] = {3, 2, 1, 0, 7, 6, 5, 4}, kAll[8] = {7, 6, 5, 4, 3, 2, 1, 0},
                                  kHalf[8] = {2, 3, 0, 1, 6, 7, 4, 5};
    exchange(hn::Shuffle2301(v), 0b10101010);
    exchange(swap_within(kFold), 0b11001100);
    exchange(hn::Shuffle2301(v), 0b10101010);
    exchange(swap_within(kAll), 0b11110000);
    exchange(swap_within(kHalf), 0b11001100);
    exchange(hn::Shuffle2301(v), 0b10101010);
    return v;
}

/// For each set of eight lanes, the lanes in ascending order.
inline constexpr auto kPacking = [] {
    std::array<std::array<std::uint8_t, 8>, 256> packing{};
    for (std::uint32_t set = 0; set < 256; ++set) {
        std::size_t count = 0;
        for (std::uint8_t lane = 0; lane < 8; ++lane)
            if ((set >> lane & 1) != 0) packing[set][count++] = lane;
    }
    return packing;
}();

/// Moves a set of lanes to the front. The lanes behind them have no meaning.
HWY_INLINE I8 packed(I8 v, Bits set) {
    const I8D d;
    const auto lanes = hn::LoadU(hn::FixedTag<std::uint8_t, 8>(), kPacking[set].data());
    return hn::TableLookupLanes(v, hn::IndicesFromVec(d, hn::PromoteTo(d, lanes)));
}

HWY_INLINE I8 load_words(const std::uint32_t* from) {
    return hn::BitCast(I8D(), hn::LoadU(hn::FixedTag<std::uint32_t, 8>(), from));
}
HWY_INLINE void store_words(I8 words, std::uint32_t* to) {
    const hn::FixedTag<std::uint32_t, 8> d;
    hn::StoreU(hn::BitCast(d, words), d, to);
}

/// Returns may_contain_zero() of x and of y.
HWY_INLINE bool both_contain_zero(float x0, float x1, float x2, float y0, float y1, float y2) {
    const float x_low = least(least(x0, x1), x2), x_high = most(most(x0, x1), x2);
    const float y_low = least(least(y0, y1), y2), y_high = most(most(y0, y1), y2);
    const bool within = (x_low <= 0) & (x_high >= 0) & (y_low <= 0) & (y_high >= 0);
    return within & ((x_low != 0) | (x_high != 0)) & ((y_low != 0) | (y_high != 0));
}

/// The searches of rays that have begun and have not ended. Results are written when a search ends.
template <class Bound, bool kAny>
class OpenSearches {
  public:
    static constexpr std::uint32_t kNone = ~0u;
    /// Most rays that are searched at once: for any hits, a tile and what is left of those before.
    static constexpr std::size_t kOpen = kOpenAlone + (kAny ? kBundle : 0);

    explicit OpenSearches(const NativeJob& job, std::vector<std::uint32_t>& delegated)
        : job_(job),
          nodes_(nodes_of<Bound>(*job.tree)),
          room_(kMostVisits + job.tree->stack_entries + kNativeWidth + 1),
          references_(std::make_unique_for_overwrite<std::uint32_t[]>(kOpen * room_)),
          nears_(std::make_unique_for_overwrite<std::int32_t[]>(kAny ? 0 : kOpen * room_)),
          single_stack_(job.tree->two_level ? job.tree->stack_entries : 0),
          delegated_(delegated) {
        for (std::size_t i = 0; i < kOpen; ++i) {
            rays_[i].base = rays_[i].top = static_cast<std::uint32_t>(i * room_ + 1);
            references_[i * room_] = 0;  // is prefetched below an empty stack
            free_[i] = static_cast<std::uint32_t>(i);
        }
    }

    /// Returns the number of searches that can be opened.
    std::size_t free_places() const { return free_count_; }

    /// Opens the search of a ray without a place to start at. Precondition: there is a free place.
    HWY_INLINE std::uint32_t open(const SingleRay& ray, std::uint32_t path, const Search& search) {
        const std::uint32_t place = free_[--free_count_];
        OpenRay& open = rays_[place];
        open.ray = ray;
        for (std::size_t a = 0; a < 3; ++a) {
            open.enter[a] = static_cast<std::uint32_t>(ray.enter[a] * kRowBytes);
            open.leave[a] = static_cast<std::uint32_t>((ray.enter[a] ^ 1) * kRowBytes);
        }
        open.path = path;
        open.search = search;
        open.exit = std::bit_cast<std::int32_t>(search.nearest.t) - (kAny ? 1 : 0);
        active_[active_count_++] = place;
        return place;
    }

    /// Lets an open search visit what is below a reference, too. Returns false if there is no room.
    HWY_INLINE bool visit(std::uint32_t place, std::uint32_t reference, float near) {
        OpenRay& open = rays_[place];
        if (shared::is_inner_node(reference)) {
            if (open.top - open.base == kMostVisits) return false;
            references_[open.top] = reference;
            if (!kAny) nears_[open.top] = std::bit_cast<std::int32_t>(near);
            ++open.top;
        } else {
            if (queued_ == kQueue) test_leaves();
            leaf_[queued_] = reference, leaf_ray_[queued_] = place;
            if (!kAny) leaf_near_[queued_] = std::bit_cast<std::int32_t>(near);
            ++queued_;
        }
        return true;
    }

    /// Adds what has been found for a ray of any hits in another way.
    HWY_INLINE void add(std::uint32_t place, const Search& other) {
        OpenRay& open = rays_[place];
        open.search.found |= other.found, open.search.out_of_range |= other.out_of_range;
        open.search.asked = std::min(open.search.asked, other.asked);
        shorten(open, open.search.found || open.search.out_of_range);
    }

    /// Goes on until at least this number of searches can be opened.
    HWY_INLINE void run(std::size_t free_places) {
        while (free_count_ < free_places) {
            test_leaves();
            close();
            visit_nodes();
        }
    }

  private:
    static constexpr std::size_t kRowBytes = kNativeWidth * sizeof(Bound);
    static constexpr std::size_t kQueue = kOpen * kNativeWidth;  // leaves of a round
    static constexpr std::size_t kMet = 64;
    static constexpr std::uint32_t kMostVisits = kAny ? 32 : 1;  // entries that visit() may put on a stack

    struct OpenRay {
        SingleRay ray;
        std::uint32_t enter[3], leave[3];  // bytes from the start of a node to the bounds where the ray enters, leaves
        std::int32_t exit;                 // bits of the end of the search
        std::uint32_t base, top, path;     // base, top: indices of references_
        Search search;
    };

    /// Two pairs of a leaf with triangles that a ray may hit.
    struct Met {
        alignas(32) float x[8], y[8], z[8], ring[8], across[8];
        const vec4* pairs;
        std::uint32_t ray;
        float near;
        Bits lanes;  // kTrianglesOfTwo
    };

    HWY_NOINLINE void visit_nodes() {
        const I8D d;
        // Local copies, because vectors that are stored may be these members as far as the compiler knows.
        std::uint32_t *const stacks = references_.get(), *const leaf = leaf_.data(), *const leaf_ray = leaf_ray_.data();
        std::int32_t *const nears = nears_.get(), *const leaf_near = leaf_near_.data();
        OpenRay* const rays = rays_.data();
        const auto* const nodes = reinterpret_cast<const char*>(nodes_);
        std::size_t queued = 0;
        const auto node_at = [=](std::uint32_t reference) HWY_ATTR {
            return nodes + (reference & shared::kBvhIndexMask) * sizeof(NativeNode<Bound>);
        };
        for (const std::uint32_t *at_ray = active_.data(), *const end = at_ray + active_count_; at_ray != end;
             ++at_ray) {
            const std::uint32_t place = *at_ray;
            OpenRay& open = rays[place];
            const RayConstants<float>& at = open.ray.at;
            std::uint32_t* const top = stacks + open.top - 1;
            const char* const node = node_at(*top);
            I8 near[3], far[3];
            for (int a = 0; a < 3; ++a) {
                near[a] = int_bits((planes(row(node, open.enter[a])) - F8(at.near_origin[a])) * F8(at.near_inverse[a]));
                far[a] = int_bits((planes(row(node, open.leave[a])) - F8(at.far_origin[a])) * F8(at.far_inverse[a]));
            }
            const I8 t_min = hn::Set(d, std::bit_cast<std::int32_t>(at.t_min));
            const I8 enter = hn::Max(hn::Max(near[0], near[1]), hn::Max(near[2], t_min));
            const I8 leave = hn::Min(hn::Min(far[0], far[1]), hn::Min(far[2], hn::Set(d, open.exit)));
            const I8 references = load_words(reinterpret_cast<const std::uint32_t*>(node + 6 * kRowBytes));
            const Bits met = bits_of(d, hn::Gt(enter, leave)) ^ 0xffu;
            const auto is_inner = hn::Lt(references, hn::Set(d, shared::kBvhTag | shared::kBvhLeaf));
            const Bits inner = met & bits_of(d, is_inner), leaves = met & ~inner;
            if constexpr (kAny) {
                store_words(packed(references, inner), top);
            } else {
                // The lowest bits of the entries, which only let searches end early, give way to places.
                const auto pushed = hn::AndNot(hn::Gt(enter, leave), is_inner);
                const I8 keys = hn::Or(hn::And(enter, hn::Set(d, ~7)), hn::Iota(d, 0));
                const I8 order = sorted(hn::IfThenElse(pushed, keys, hn::Set(d, -1)));
                store_words(hn::TableLookupLanes(references, hn::IndicesFromVec(d, hn::And(order, hn::Set(d, 7)))),
                            top);
                hn::StoreU(hn::And(order, hn::Set(d, ~7)), d, nears + (top - stacks));
                hn::StoreU(packed(enter, leaves), d, leaf_near + queued);
            }
            store_words(packed(references, leaves), leaf + queued);
            store_words(hn::Set(d, static_cast<std::int32_t>(place)), leaf_ray + queued);
            const auto inner_count = std::popcount(inner);
            open.top += static_cast<std::uint32_t>(inner_count) - 1;
            queued += static_cast<std::size_t>(std::popcount(leaves));
            // The next node of the ray is read a round later.
            const char* const next = node_at(top[inner_count - 1]);
            for (std::size_t line = 0; line < sizeof(NativeNode<Bound>); line += 64) hwy::Prefetch(next + line);
        }
        queued_ = queued;
    }

    static HWY_INLINE const std::array<Bound, 8>& row(const char* node, std::uint32_t offset) {
        return *reinterpret_cast<const std::array<Bound, 8>*>(node + offset);
    }

    HWY_INLINE const vec4* pairs_of(std::uint32_t leaf) const {
        return job_.pairs + std::size_t{leaf & shared::kBvhIndexMask} * shared::kBvhPairTexels;
    }

    HWY_NOINLINE void test_leaves() {
        std::size_t met = 0;
        for (std::size_t i = 0; i < queued_; ++i) {
            const std::uint32_t leaf = leaf_[i];
            const vec4* const ahead = pairs_of(leaf_[std::min(i + 4, queued_ - 1)]);
            hwy::Prefetch(ahead);
            hwy::Prefetch(ahead + shared::kBvhPairTexels);
            OpenRay& open = rays_[leaf_ray_[i]];
            const float near = kAny ? 0.0f : std::bit_cast<float>(leaf_near_[i]);
            if (shared::is_leaf(leaf) && !job_.slivers) {
                met = find_met(open, leaf, leaf_ray_[i], near, met);
                continue;
            }
            if ((kAny && open.search.found) || open.search.out_of_range) continue;
            const bool ends =
                shared::is_leaf(leaf)
                    ? test_leaf_in_doubles<kAny>(job_, open.ray, leaf, 0, near, open.search)
                    : search_instance<Bound, kAny>(job_, job_.rays[open.path], leaf, std::bit_cast<std::int32_t>(near),
                                                   single_stack_.data(), open.search);
            shorten(open, ends);
        }
        take_met(met);
        queued_ = 0;
    }

    /// Adds the pairs of a leaf with triangles that the ray may hit to `met_`. Returns their new number.
    HWY_INLINE std::size_t find_met(const OpenRay& open, std::uint32_t leaf, std::uint32_t place, float near,
                                    std::size_t met) {
        const hn::FixedTag<float, 8> d;
        const RayConstants<float>& at = open.ray.at;
        const std::uint32_t count = (leaf >> shared::kBvhCountShift) & 7u;
        const vec4* pairs = pairs_of(leaf);
        const F8 origin[3] = {F8(at.origin[0]), F8(at.origin[1]), F8(at.origin[2])};
        const F8 shear[2] = {F8(at.shear[0]), F8(at.shear[1])};
        for (std::uint32_t i = 0; i < count; i += 2, pairs += 2 * shared::kBvhPairTexels) {
            const vec4* const other = pairs + (i + 1 < count ? shared::kBvhPairTexels : 0);
            const Corners4<F8> c(two_rows(pairs, other, open.ray.axes[0]), two_rows(pairs, other, open.ray.axes[1]),
                                 two_rows(pairs, other, open.ray.axes[2]), origin, shear);
            const auto within = hn::AndNot(c.beyond(d, at.shear[2], at.t_min, open.search.nearest.t), c.on_line());
            const Bits lanes = bits_of(d, within) & (i + 1 < count ? kTrianglesOfTwo : kTriangles);
            Met& m = met_[met];
            c.x.store(m.x), c.y.store(m.y), c.z.store(m.z), c.ring.store(m.ring), c.across.store(m.across);
            m.pairs = pairs, m.ray = place, m.near = near, m.lanes = lanes;
            met += lanes != 0 ? 1 : 0;
            if (met == kMet) {
                take_met(met);
                met = 0;
            }
        }
        return met;
    }

    HWY_INLINE void take_met(std::size_t count) {
        for (std::size_t i = 0; i < count; ++i) {
            const Met& m = met_[i];
            OpenRay& open = rays_[m.ray];
            if (kAny && open.search.found) continue;
            bool ends = false;
            for (Bits met = m.lanes; met != 0 && !ends; met &= met - 1) {
                const auto lane = static_cast<Bits>(std::countr_zero(met)), first = lane & 4, half = lane >> 1 & 1;
                const Bits one = first + 2 * half, two = first + 1 + 2 * half, three = first + 2 - 2 * half;
                if (!both_contain_zero(m.x[one], m.x[two], m.x[three], m.y[one], m.y[two], m.y[three])) continue;
                // triangle_of() without a branch, which would be mispredicted often
                const TriangleOf<float> triangle{
                    {m.ring[first + 1 + half], m.ring[first + 3 * half], m.across[first] * (half != 0 ? 1.0f : -1.0f)},
                    {m.z[first], m.z[first + 2], m.z[first + 1 + 2 * half]}};
                const vec4* const pair = m.pairs + (lane >> 2) * shared::kBvhPairTexels;
                ends = take<kAny, float>(job_, open.ray, open.ray.at.shear[2], triangle, pair, half != 0, 0, m.near,
                                         open.search);
            }
            shorten(open, ends);
        }
    }

    /// Drops what the search need not visit any more. `ends`: nothing is left.
    HWY_INLINE void shorten(OpenRay& open, bool ends) {
        if (ends) open.top = open.base;
        if constexpr (!kAny) {
            const auto exit = std::bit_cast<std::int32_t>(open.search.nearest.t);
            if (exit == open.exit) return;
            open.exit = exit;
            const I8D d;
            std::uint32_t to = open.base;
            for (std::uint32_t from = open.base; from < open.top; from += 8) {
                const I8 near = hn::LoadU(d, &nears_[from]);
                const I8 references = load_words(&references_[from]);
                const auto stays = hn::AndNot(hn::Gt(near, hn::Set(d, exit)), hn::FirstN(d, open.top - from));
                const Bits set = bits_of(d, stays);
                hn::StoreU(packed(near, set), d, &nears_[to]);
                store_words(packed(references, set), &references_[to]);
                to += static_cast<std::uint32_t>(std::popcount(set));
            }
            open.top = to;
        }
    }

    /// Writes the results of the searches that have nothing left to visit.
    HWY_NOINLINE void close() {
        std::size_t stay = 0, ended = free_count_;
        for (std::size_t i = 0; i < active_count_; ++i) {
            const std::uint32_t place = active_[i];
            // 0 or 1, without a branch, which would be mispredicted
            const std::size_t stays = (rays_[place].base - rays_[place].top) >> 31;
            active_[stay] = free_[ended] = place;
            stay += stays, ended += 1 - stays;
        }
        active_count_ = stay;
        for (; free_count_ != ended; ++free_count_) {
            const OpenRay& open = rays_[free_[free_count_]];
            put(job_, open.path, open.search, delegated_);
        }
    }

    const NativeJob& job_;
    const NativeNode<Bound>* nodes_;
    std::size_t room_;  // entries of a stack
    // Stacks: inner nodes, and bits of where the ray enters them.
    std::unique_ptr<std::uint32_t[]> references_;
    std::unique_ptr<std::int32_t[]> nears_;
    std::vector<StackEntry> single_stack_;
    std::vector<std::uint32_t>& delegated_;
    std::size_t active_count_ = 0, free_count_ = kOpen, queued_ = 0;
    std::array<std::uint32_t, kOpen + 1> active_, free_;  // places of rays_
    std::array<std::uint32_t, kQueue + 8> leaf_, leaf_ray_;
    std::array<std::int32_t, kAny ? 1 : kQueue + 8> leaf_near_;
    std::array<Met, kMet> met_;
    std::array<OpenRay, kOpen> rays_;
};

/// Traces up to 64 rays, each by itself.
template <class Bound, bool kAny>
void open_rays(const NativeJob& job, const std::uint32_t* paths, std::size_t count, OpenSearches<Bound, kAny>& open,
               std::vector<std::uint32_t>& delegated) {
    const NativeSpace& space = job.tree->spaces.front();
    const SingleRays rays(job, space, paths, count);
    for (std::size_t i = 0; i < count; ++i) {
        if (i % kLanes == 0) open.run(open.kOpen - kOpenAlone + kLanes);
        Search search;
        search.nearest = {rays.t_max(i), 0, 0, 0, 0};
        search.out_of_range = rays.out_of_range(i);
        if (rays.lives(i)) {
            const SingleRay ray = rays.ray(i);
            open.visit(open.open(ray, paths[i], search), space.root, ray.at.t_min);
        } else {
            put(job, paths[i], search, delegated);
        }
    }
}

}  // namespace halflight::rays::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
