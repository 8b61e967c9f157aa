// Intersection of a ray with pairs of triangles, as in shaders/lib/intersect.glsl and intersect_place() of
// traverse.glsl: equal operations in equal order. Compiled once per instruction set.
#if defined(HALFLIGHT_NATIVE_PAIRS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HALFLIGHT_NATIVE_PAIRS_INL
#undef HALFLIGHT_NATIVE_PAIRS_INL
#else
#define HALFLIGHT_NATIVE_PAIRS_INL
#endif

#include "engine/rays/native_ray-inl.h"
#include "engine/rays/native_trace.h"

HWY_BEFORE_NAMESPACE();
namespace halflight::rays::HWY_NAMESPACE {

using shared::Hit;

/// Edge functions and z of the corners of a pair (PairEdges).
template <class F>
struct Edges {
    F ring[4], z[4];
    F across;
};

/// A sum whose bits do not depend on the order of the terms.
template <class F>
HWY_INLINE F sum_of(F x, F y, F z) {
    const F smallest = least(least(x, y), z), largest = most(most(x, y), z);
    const F middle = most(least(x, y), least(most(x, y), z));
    return (smallest + largest) + middle;
}

/// Triangle of a pair with its corners in the order of the pair: edges and z of the ring's corners 0 and 2, and of its
/// third corner.
template <class F>
struct TriangleOf {
    F edge[3], z[3];
};

template <class F>
HWY_INLINE TriangleOf<F> triangle_of(const Edges<F>& e, bool second) {
    if (second) return {{e.ring[2], e.ring[3], e.across}, {e.z[0], e.z[2], e.z[3]}};
    return {{e.ring[1], e.ring[0], negated(e.across)}, {e.z[0], e.z[2], e.z[1]}};
}

/// t and the weights of the second and third corner, in the order of the file.
template <class R>
struct PointOf {
    R t, u, v;
};

/// `order` holds the places of the file's second and third corner.
template <class F>
HWY_INLINE PointOf<F> point_of(const TriangleOf<F>& triangle, std::uint32_t order, F inverse_z) {
    const std::uint32_t second = order & 3u, third = (order >> 2) & 3u, first = 3u - second - third;
    const F *const e = triangle.edge, *const z = triangle.z;
    const F inverse = F(1) / (e[first] + e[second] + e[third]);
    return {(e[first] * z[first] + e[second] * z[second] + e[third] * z[third]) * inverse_z * inverse,
            e[second] * inverse, e[third] * inverse};
}

template <class F>
HWY_INLINE F pair_t(const TriangleOf<F>& triangle, F inverse_z) {
    const F *const e = triangle.edge, *const z = triangle.z;
    const F inverse = F(1) / sum_of(e[0], e[1], e[2]);
    return sum_of(e[0] * z[0], e[1] * z[1], e[2] * z[2]) * inverse_z * inverse;
}

/// Returns whether corners in the order of the edge functions of a pair's triangle are clockwise as seen from its
/// front.
HWY_INLINE bool turned(bool second, std::uint32_t order, std::uint32_t flags) {
    const bool in_file_order = ((shared::kBvhEvenOrders >> (order & 15u)) & 1u) != 0;
    return (in_file_order == second) == ((flags & shared::kBvhMirrored) != 0);
}

HWY_INLINE bool is_pane(std::uint32_t flags) {
    return (flags & (shared::kBvhOneSided | shared::kBvhMirrored)) == shared::kBvhMirrored;
}

/// Result of the search of one ray so far.
struct Search {
    Hit nearest;  // closest hit; t: end of the search
    bool found = false;
    bool out_of_range = false;  // the plain kernel must trace the ray
    // t of the nearest alpha-tested triangle that was met; 0 for any hits; +inf: none
    float asked = kInfinity;

    /// Returns whether the plain kernel must trace the ray.
    HWY_INLINE bool delegated(bool any_hit) const {
        return out_of_range || (any_hit ? asked == 0 && !found : asked <= nearest.t && asked < kInfinity);
    }
};

/// Writes the result of a ray, or leaves it to the plain kernel.
HWY_INLINE void put(const NativeJob& job, std::uint32_t path, const Search& search,
                    std::vector<std::uint32_t>& delegated) {
    if (search.delegated(job.any_hit)) {
        delegated.push_back(path);
    } else if (job.any_hit) {
        static_cast<std::uint32_t*>(job.results)[path] = search.found ? shared::kOccluded : shared::kFree;
    } else {
        static_cast<Hit*>(job.results)[path] =
            search.found ? search.nearest : Hit{kInfinity, 0, 0, shared::kMiss, shared::kMiss};
    }
}

/// Words of a pair: ids, orders and flags.
struct PairWords {
    std::uint32_t id[2], orders, unused;
};

/// Returns triangle_near().
HWY_INLINE float triangle_near(const SingleRay& ray, const vec4* pair, bool second) {
    float near = 0;
    for (int k = 0; k < 2; ++k) {
        const vec4& row = pair[ray.axes[k]];
        const float o = ray.at.origin[k], inverse = ray.at.entry_inverse[k];
        const float t0 = (row.x - o) * inverse, t1 = (row.z - o) * inverse,
                    t2 = ((second ? row.w : row.y) - o) * inverse;
        const float entry = least(least(t0, t1), t2) - ray.at.entry_error[k];
        near = k == 0 ? entry : most(near, entry);
    }
    return near;
}

/// Records a hit on a triangle of a pair if it is the nearest so far. Returns true if the search of the ray ends.
template <bool kAny, Real R>
HWY_INLINE bool take(const NativeJob& job, const SingleRay& ray, R inverse_z, TriangleOf<R> triangle, const vec4* pair,
                     bool second, std::uint32_t instance, float leaf_near, Search& search) {
    const R edges = triangle.edge[0] + triangle.edge[1] + triangle.edge[2];
    if (triangle.edge[0] == 0 && triangle.edge[1] == 0 && triangle.edge[2] == 0)
        triangle.edge[0] = triangle.edge[1] = triangle.edge[2] = R(1);
    PairWords words;
    std::memcpy(&words, &pair[3], sizeof(words));
    const std::uint32_t flags = second ? words.orders >> shared::kBvhFlagShift : words.orders;
    if (job.passes_panes && is_pane(flags)) return false;
    const bool asks = job.alpha_tested && (flags & shared::kBvhAlphaTested) != 0;
    const std::uint32_t order = second ? words.orders >> shared::kBvhOrderShift : words.orders;
    if ((flags & shared::kBvhOneSided) != 0 && job.passes_backs(ray.at.t_min) && edges != 0 &&
        ((edges > 0) == (inverse_z > 0)) != turned(second, order, flags))
        return false;
    // Most triangles are refused by the point of the hit. Their entry, which can only raise t, is not needed.
    if constexpr (kAny) {
        const auto t = static_cast<float>(pair_t(triangle, inverse_z));
        const bool by_point = job.alpha_tested || job.backfaces != 0;
        const float after = by_point ? static_cast<float>(point_of(triangle, order, inverse_z).t) : t;
        if (!(after > ray.at.t_min && t < search.nearest.t)) return false;
        if (!(triangle_near(ray, pair, second) < search.nearest.t)) return false;
        if (asks) search.asked = 0;
        search.found = !asks;
        return search.found;
    } else {
        const PointOf<R> p = point_of(triangle, order, inverse_z);
        const auto point = static_cast<float>(p.t);
        Hit& n = search.nearest;
        if (!(point > ray.at.t_min && point <= n.t)) return false;
        const float t = most(point, most(triangle_near(ray, pair, second), leaf_near));
        const std::uint32_t id = words.id[second ? 1 : 0] & shared::kBvhTriangleMask;
        const bool wins_tie = instance < n.instance || (instance == n.instance && id < n.triangle);
        if (!(t < n.t || (t == n.t && wins_tie))) return false;
        if (asks) {
            search.asked = std::min(search.asked, t);
            return false;
        }
        n = {t, static_cast<float>(p.u), static_cast<float>(p.v), id, instance};
        search.found = true;
        return false;
    }
}

using F8 = Lanes<hn::FixedTag<float, 8>>;
using F4 = Lanes<hn::FixedTag<float, 4>>;
using D4 = Lanes<hn::FixedTag<double, 4>>;

HWY_INLINE F8 two_rows(const vec4* first, const vec4* second, int axis) {
    const hn::FixedTag<float, 4> d;
    return hn::Combine(hn::FixedTag<float, 8>(), hn::LoadU(d, &second[axis].x), hn::LoadU(d, &first[axis].x));
}
HWY_INLINE F8 next_corner(F8 v) {
    return hn::Shuffle0321(v.v);
}
HWY_INLINE F8 opposite_corner(F8 v) {
    return hn::Shuffle1032(v.v);
}
HWY_INLINE D4 next_corner(D4 v) {
    alignas(32) static constexpr std::int64_t kPlaces[4] = {1, 2, 3, 0};
    return hn::TableLookupLanes(v.v, hn::SetTableIndices(hn::FixedTag<double, 4>(), kPlaces));
}
HWY_INLINE D4 opposite_corner(D4 v) {
    alignas(32) static constexpr std::int64_t kPlaces[4] = {2, 3, 0, 1};
    return hn::TableLookupLanes(v.v, hn::SetTableIndices(hn::FixedTag<double, 4>(), kPlaces));
}

/// Returns whether the bounds of three corners' coordinates contain zero and more than zero, as both_may_contain_zero()
/// does for numbers.
template <class F>
HWY_INLINE auto may_contain_zero(F a, F b, F c) {
    const F low = least(least(a, b), c), high = most(most(a, b), c), zero(0);
    // Some corner is not zero if low or high is not.
    return hn::And(hn::And(hn::Le(low.v, zero.v), hn::Ge(high.v, zero.v)),
                   hn::Or(hn::Ne(low.v, zero.v), hn::Ne(high.v, zero.v)));
}

/// Bits of the lanes that stand for triangles: lane 0 of a pair's four lanes for its first triangle, lane 2 for its
/// second one. Other lanes have no meaning.
constexpr Bits kTriangles = 0x5, kTrianglesOfTwo = 0x55;

/// Corners of pairs relative to the ray, four lanes each, and what follows from them (intersect_pair()). The corners of
/// a triangle are that of its lane, the next one and the opposite one. Lane 2 of `across` is the negative of lane 0.
template <class F>
struct Corners4 {
    F x, y, z, ring, across;
    HWY_INLINE Corners4(F row_x, F row_y, F row_z, const F* origin, const F* shear) {
        z = row_z - origin[2];
        x = (row_x - origin[0]) - shear[0] * z;
        y = (row_y - origin[1]) - shear[1] * z;
        ring = x * next_corner(y) - y * next_corner(x);
        across = x * opposite_corner(y) - y * opposite_corner(x);
    }
    /// Returns the triangles that the ray's line hits: those whose edge functions have no opposite signs.
    HWY_INLINE auto on_line() const {
        const F next = next_corner(ring), back = negated(across), zero(0);
        return hn::Or(hn::Ge(least(least(ring, next), back).v, zero.v), hn::Le(most(most(ring, next), back).v, zero.v));
    }
    /// Returns the triangles whose projections may contain zero in x and y.
    HWY_INLINE auto contain_zero() const {
        const auto along = [](F v) HWY_ATTR { return may_contain_zero(v, next_corner(v), opposite_corner(v)); };
        return hn::And(along(x), along(y));
    }
    /// Returns triangles whose pair_t() is certainly below t_min or above t_max. Most triangles that the line hits lie
    /// behind the ray, or behind its end. The sums of pair_t() are found for all triangles at once. Rounding, in any
    /// order of the operations, is far below the margin.
    template <class D>
    HWY_INLINE auto beyond(D d, float inverse_z, float t_min, float t_max) const {
        constexpr float kMargin = 0x1p-20f, kUnderflow = 0x1p-120f;
        const F next_ring = next_corner(ring);
        const F a = ring * opposite_corner(z), b = next_ring * z, c = across * next_corner(z);
        const F sum = (ring + next_ring) - across, scale = magnitude(sum);
        const F t = ((a + b) - c) * F(inverse_z);  // times scale, after the change of sign
        const F signed_t = hn::Xor(t.v, hn::And(hn::SignBit(d), sum.v));
        const F margin =
            (((magnitude(a) + magnitude(b)) + magnitude(c)) + F(kUnderflow)) * F(std::abs(inverse_z) * kMargin);
        return hn::Or(hn::Lt((signed_t + margin).v, (F(t_min) * scale).v),
                      hn::Gt((signed_t - margin).v, (F(t_max) * scale).v));
    }
};

/// Tests the pairs of a leaf. Returns true if the search of the ray ends.
template <bool kAny>
HWY_INLINE bool test_leaf(const NativeJob& job, const SingleRay& ray, std::uint32_t leaf, std::uint32_t instance,
                          float leaf_near, Search& search) {
    const std::uint32_t count = (leaf >> shared::kBvhCountShift) & 7u;
    const vec4* const pairs = job.pairs + std::size_t{leaf & shared::kBvhIndexMask} * shared::kBvhPairTexels;
    const F8 origin[3] = {F8(ray.at.origin[0]), F8(ray.at.origin[1]), F8(ray.at.origin[2])};
    const F8 shear[2] = {F8(ray.at.shear[0]), F8(ray.at.shear[1])};
    for (std::uint32_t i = 0; i < count; i += 2) {
        const vec4* const pair[2] = {pairs + i * shared::kBvhPairTexels,
                                     pairs + std::min(i + 1, count - 1) * shared::kBvhPairTexels};
        const Corners4<F8> c(two_rows(pair[0], pair[1], ray.axes[0]), two_rows(pair[0], pair[1], ray.axes[1]),
                             two_rows(pair[0], pair[1], ray.axes[2]), origin, shear);
        const hn::FixedTag<float, 8> d;
        const auto on_line = c.on_line();
        const auto within = hn::AndNot(c.beyond(d, ray.at.shear[2], ray.at.t_min, search.nearest.t), on_line);
        const Bits met_pairs = i + 1 < count ? kTrianglesOfTwo : kTriangles;
        Bits met = bits_of(d, within) & met_pairs;
        if (met == 0) continue;
        met &= bits_of(d, c.contain_zero());
        alignas(32) float ring[8], z[8], across[8];
        c.ring.store(ring), c.z.store(z), c.across.store(across);
        for (; met != 0; met &= met - 1) {
            const auto lane = static_cast<Bits>(std::countr_zero(met)), first = lane & 4, half = lane >> 1 & 1;
            // triangle_of() without a branch, which would be mispredicted often
            const TriangleOf<float> triangle{
                {ring[first + 1 + half], ring[first + 3 * half], across[first] * (half != 0 ? 1.0f : -1.0f)},
                {z[first], z[first + 2], z[first + 1 + 2 * half]}};
            if (take<kAny, float>(job, ray, ray.at.shear[2], triangle, pair[lane >> 2], half != 0, instance, leaf_near,
                                  search))
                return true;
        }
    }
    return false;
}

/// Does the same for scenes with slivers, with corners and edges in doubles.
template <bool kAny>
HWY_NOINLINE bool test_leaf_in_doubles(const NativeJob& job, const SingleRay& ray, std::uint32_t leaf,
                                       std::uint32_t instance, float leaf_near, Search& search) {
    const std::uint32_t count = (leaf >> shared::kBvhCountShift) & 7u;
    const vec4* pair = job.pairs + std::size_t{leaf & shared::kBvhIndexMask} * shared::kBvhPairTexels;
    const hn::FixedTag<double, 4> d;
    const hn::FixedTag<float, 4> f;
    const double inverse = 1.0 / double{ray.at.direction[ray.axes[2]]};
    const D4 origin[3] = {D4(ray.at.origin[0]), D4(ray.at.origin[1]), D4(ray.at.origin[2])};
    const D4 shear[2] = {D4(double{ray.at.direction[ray.axes[0]]} * inverse),
                         D4(double{ray.at.direction[ray.axes[1]]} * inverse)};
    for (std::uint32_t i = 0; i < count; ++i, pair += shared::kBvhPairTexels) {
        const Corners4<D4> c(hn::PromoteTo(d, hn::LoadU(f, &pair[ray.axes[0]].x)),
                             hn::PromoteTo(d, hn::LoadU(f, &pair[ray.axes[1]].x)),
                             hn::PromoteTo(d, hn::LoadU(f, &pair[ray.axes[2]].x)), origin, shear);
        Bits met = bits_of(d, c.on_line()) & kTriangles;
        if (met != 0) met &= bits_of(d, c.contain_zero());
        if (met == 0) continue;
        alignas(32) double across[4];
        Edges<double> e;
        alignas(32) double ring[4], z[4];
        c.ring.store(ring), c.z.store(z), c.across.store(across);
        for (Bits k = 0; k < 4; ++k) e.ring[k] = ring[k], e.z[k] = z[k];
        e.across = across[0];
        for (; met != 0; met &= met - 1) {
            const bool second = (met & 1) == 0;
            if (take<kAny, double>(job, ray, inverse, triangle_of(e, second), pair, second, instance, leaf_near,
                                   search))
                return true;
        }
    }
    return false;
}

}  // namespace halflight::rays::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
