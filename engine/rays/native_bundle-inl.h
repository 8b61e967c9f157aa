// Traversal of the eight-wide hierarchy by up to 64 rays at once. Compiled once per instruction set.
//
// Inner nodes are tested against the chord shaft of the bundle (shaders/lib/shaft.glsl has the tiles' one): the box
// that moves linearly, s in [0, 1], from the box of the rays' origins to the box of their ends. This costs as much as
// one ray. At leaves each ray is tested by itself, a ray per lane, with the arithmetic of the plain tracer. The shaft
// is wider than all errors, so that no leaf is lost.
#if defined(HALFLIGHT_NATIVE_BUNDLE_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HALFLIGHT_NATIVE_BUNDLE_INL
#undef HALFLIGHT_NATIVE_BUNDLE_INL
#else
#define HALFLIGHT_NATIVE_BUNDLE_INL
#endif

#include "engine/rays/native_single-inl.h"

HWY_BEFORE_NAMESPACE();
namespace halflight::rays::HWY_NAMESPACE {

inline constexpr std::size_t kBundle = 64;

using FN = Lanes<hn::CappedTag<float, 16>>;
using DN = hn::CappedTag<float, 16>;
using IN = hn::Vec<hn::CappedTag<std::int32_t, 16>>;
using MN = hn::Mask<DN>;
inline constexpr std::size_t kLanes = FN::kCount;
inline constexpr std::size_t kVectors = kBundle / kLanes;

/// Up to 64 rays, an array element each. The last vector is padded with dead rays.
struct alignas(64) Bundle {
    template <class T>
    using Row = std::array<T, kBundle>;
    Row<float> world_origin[3], direction[3], t_min;
    // RayConstants
    Row<float> near_origin[3], near_inverse[3], far_origin[3], far_inverse[3];
    Row<float> origin[3], shear[3], entry_inverse[2], entry_error[2], error;
    Row<std::int32_t> exit;     // bits of the end of the search; less than t_min: the ray is done
    Row<float> t, u, v, asked;  // Search
    Row<std::int32_t> triangle, instance;
    Row<float> end;  // T: parameter of the ray's end, > 0, for the shaft
    Row<std::uint32_t> path;
    std::array<std::uint8_t, kBundle> axis;               // main_axis()
    std::array<int, kVectors> common_axis;                // main axis of all rays of a vector; -1: they differ
    std::size_t count = 0;                                // rays
    std::uint64_t found = 0, out_of_range = 0, live = 0;  // a bit per ray
};

HWY_INLINE std::uint64_t bits_at(std::size_t vector, Bits bits) {
    return std::uint64_t{bits} << (vector * kLanes);
}

/// Sets the constants of all rays, and which of them live.
HWY_INLINE void set_rays(Bundle& b, const NativeJob& job, const NativeSpace& space, const std::uint32_t* paths,
                         std::size_t count) {
    b.count = count;
    for (std::size_t i = 0; i < kBundle; ++i) {
        const std::uint32_t path = paths[std::min(i, count - 1)];
        const shared::Ray& ray = job.rays[path];
        b.path[i] = path;
        for (int a = 0; a < 3; ++a) b.world_origin[a][i] = ray.origin[a], b.direction[a][i] = ray.direction[a];
        b.t_min[i] = ray.t_min;
        b.t[i] = ray.t_max;
        b.axis[i] = static_cast<std::uint8_t>(main_axis(ray.direction.x, ray.direction.y, ray.direction.z));
    }
    const DN d;
    const hn::RebindToSigned<DN> di;
    const bool on_grid = job.tree->format == NodeFormat::grid;
    b.found = b.out_of_range = b.live = 0;
    for (std::size_t k = 0, at = 0; k < kVectors; ++k, at += kLanes) {
        FN origin[3], direction[3];
        for (int a = 0; a < 3; ++a)
            origin[a] = FN::load(&b.world_origin[a][at]), direction[a] = FN::load(&b.direction[a][at]);
        RayConstants<FN> c;
        set_constants(c, origin, direction, space, on_grid);
        for (int a = 0; a < 3; ++a) {
            c.near_origin[a].store(&b.near_origin[a][at]), c.near_inverse[a].store(&b.near_inverse[a][at]);
            c.far_origin[a].store(&b.far_origin[a][at]), c.far_inverse[a].store(&b.far_inverse[a][at]);
            c.origin[a].store(&b.origin[a][at]), c.shear[a].store(&b.shear[a][at]);
        }
        for (int a = 0; a < 2; ++a)
            c.entry_inverse[a].store(&b.entry_inverse[a][at]), c.entry_error[a].store(&b.entry_error[a][at]);
        c.error.store(&b.error[at]);
        const FN t_min = FN::load(&b.t_min[at]), t_max = FN::load(&b.t[at]), zero(0);
        FN(kInfinity).store(&b.asked[at]);
        zero.store(&b.u[at]), zero.store(&b.v[at]);
        hn::Store(hn::Zero(di), di, &b.triangle[at]);
        hn::Store(hn::Zero(di), di, &b.instance[at]);
        // in_range()
        const FN size = most(most(magnitude(direction[0]), magnitude(direction[1])), magnitude(direction[2]));
        const MN good = hn::And(hn::And(hn::Ge(size.v, hn::Set(d, 0x1p-40f)), hn::Le(size.v, hn::Set(d, 0x1p40f))),
                                hn::And(hn::Le(c.error.v, hn::Set(d, space.slack * 0x1p40f)), hn::Ge(t_min.v, zero.v)));
        const Bits lives = bits_of(d, hn::Ge(t_max.v, t_min.v)), ranged = bits_of(d, good);
        b.live |= bits_at(k, lives & ranged);
        b.out_of_range |= bits_at(k, lives & ~ranged);
        IN exit = hn::BitCast(di, t_max.v);
        if (job.any_hit) exit = hn::Sub(exit, hn::Set(di, 1));
        hn::Store(hn::IfThenElse(hn::RebindMask(di, hn::And(good, hn::Ge(t_max.v, t_min.v))), exit, hn::Set(di, -1)),
                  di, &b.exit[at]);
        int axis = b.axis[at];
        for (std::size_t i = 1; i < kLanes; ++i)
            if (b.axis[at + i] != axis) axis = -1;
        b.common_axis[k] = axis;
    }
    const std::uint64_t all = count == kBundle ? ~std::uint64_t{0} : (std::uint64_t{1} << count) - 1;
    b.live &= all, b.out_of_range &= all;
    for (std::size_t i = count; i < kBundle; ++i) b.exit[i] = -1;
}

HWY_INLINE SingleRay single_ray(const Bundle& b, std::size_t i) {
    SingleRay ray;
    RayConstants<float>& c = ray.at;
    for (int a = 0; a < 3; ++a) {
        c.near_origin[a] = b.near_origin[a][i], c.near_inverse[a] = b.near_inverse[a][i];
        c.far_origin[a] = b.far_origin[a][i], c.far_inverse[a] = b.far_inverse[a][i];
        c.direction[a] = b.direction[a][i], c.origin[a] = b.origin[a][i], c.shear[a] = b.shear[a][i];
    }
    for (int a = 0; a < 2; ++a) c.entry_inverse[a] = b.entry_inverse[a][i], c.entry_error[a] = b.entry_error[a][i];
    c.error = b.error[i];
    ray.finish(b.t_min[i]);
    return ray;
}

/// The shaft's planes against nodes: s passes them at (bound - origin) * inverse. The first `near_count` ones bound s
/// from below, the others from above.
struct ShaftTest {
    std::size_t plane[6];  // index of NativeNode::bounds
    float origin[6], inverse[6];
    int near_count = 0;

    HWY_INLINE void add(bool near, std::size_t bound, float from, float slope) {
        int at = 5 - (count_ - near_count);
        if (near) at = near_count++;
        ++count_;
        plane[at] = bound, origin[at] = from, inverse[at] = 1 / slope;
    }

  private:
    int count_ = 0;
};

HWY_INLINE float least_lane(FN v) {
    return hn::GetLane(hn::MinOfLanes(DN(), v.v));
}
HWY_INLINE float most_lane(FN v) {
    return hn::GetLane(hn::MaxOfLanes(DN(), v.v));
}

/// Prepares the shaft of the living rays, and their ends. Rays that miss the space's hull are done. Returns whether
/// rays are left.
HWY_INLINE bool make_shaft(Bundle& b, const NativeSpace& space, bool on_grid, ShaftTest& shaft) {
    const DN d;
    const hn::RebindToSigned<DN> di;
    float hull[2][3];
    for (int a = 0; a < 3; ++a) {
        hull[0][a] = on_grid ? 0 : space.base[a];
        hull[1][a] = on_grid ? shared::kGridCells : space.base[a] + shared::kGridCells * space.cell[a] * 1.00001f;
    }
    FN lower[2][3], upper[2][3], error(0);  // boxes of origins and ends
    for (int e = 0; e < 2; ++e)
        for (int a = 0; a < 3; ++a) lower[e][a] = FN(kInfinity), upper[e][a] = FN(-kInfinity);
    for (std::size_t k = 0, at = 0; k < kVectors; ++k, at += kLanes) {
        IN exit = hn::Load(di, &b.exit[at]);
        FN end = hn::BitCast(d, exit);
        for (int a = 0; a < 3; ++a) {
            const MN backward = below(FN::load(&b.direction[a][at]), FN(0.0f));
            const FN plane = select(backward, FN(hull[0][a]), FN(hull[1][a]));
            end = least(end, (plane - FN::load(&b.far_origin[a][at])) * FN::load(&b.far_inverse[a][at]));
        }
        const MN lives =
            hn::And(hn::RebindMask(d, hn::Gt(exit, hn::Set(di, -1))), hn::Ge(end.v, FN::load(&b.t_min[at]).v));
        hn::Store(hn::IfThenElse(hn::RebindMask(di, lives), exit, hn::Set(di, -1)), di, &b.exit[at]);
        b.live &= ~(bits_at(k, ~bits_of(d, lives) & ((1u << kLanes) - 1)));
        end = end * FN(1.00001f);
        end.store(&b.end[at]);
        error = most(error, select(lives, FN::load(&b.error[at]), FN(0.0f)));
        for (int a = 0; a < 3; ++a) {
            const FN from = FN::load(&b.world_origin[a][at]), to = from + FN::load(&b.direction[a][at]) * end;
            lower[0][a] = least(lower[0][a], select(lives, from, FN(kInfinity)));
            upper[0][a] = most(upper[0][a], select(lives, from, FN(-kInfinity)));
            lower[1][a] = least(lower[1][a], select(lives, to, FN(kInfinity)));
            upper[1][a] = most(upper[1][a], select(lives, to, FN(-kInfinity)));
        }
    }
    if (b.live == 0) return false;
    const float margin = 4 * most_lane(error);
    shaft = ShaftTest();
    for (int a = 0; a < 3; ++a) {
        const float base = on_grid ? space.base[a] : 0, cell = on_grid ? space.cell[a] : 1;
        float l[2], u[2], m = margin / cell;
        for (int e = 0; e < 2; ++e) {
            l[e] = (least_lane(lower[e][a]) - base) / cell, u[e] = (most_lane(upper[e][a]) - base) / cell;
            m = std::max(m, 0x1p-20f * std::max(std::abs(l[e]), std::abs(u[e])) + margin / cell);
        }
        for (int e = 0; e < 2; ++e) l[e] -= m, u[e] += m;
        // Planes that hardly move are taken as moving apart slowly.
        float lower_slope = l[1] - l[0], upper_slope = u[1] - u[0];
        if (std::abs(lower_slope) <= m) l[0] = std::min(l[0], l[1]) - m, lower_slope = m;
        if (std::abs(upper_slope) <= m) u[0] = std::max(u[0], u[1]) + m, upper_slope = -m;
        const auto axis = static_cast<std::size_t>(a);
        shaft.add(lower_slope < 0, 2 * axis + 1, l[0], lower_slope);  // l(s) <= the node's upper bound
        shaft.add(upper_slope > 0, 2 * axis, u[0], upper_slope);      // u(s) >= the node's lower bound
    }
    return true;
}

template <class Bound>
HWY_INLINE Bits meet_shaft(const NativeNode<Bound>& node, const ShaftTest& shaft, float exit, std::int32_t* near_out) {
    const hn::FixedTag<std::int32_t, 8> d;
    F8 near(0.0f), far(exit);
    int k = 0;
    for (; k < shaft.near_count; ++k)
        near = most(near, (planes(node.bounds[shaft.plane[k]]) - F8(shaft.origin[k])) * F8(shaft.inverse[k]));
    for (; k < 6; ++k)
        far = least(far, (planes(node.bounds[shaft.plane[k]]) - F8(shaft.origin[k])) * F8(shaft.inverse[k]));
    hn::Store(int_bits(near), d, near_out);
    return bits_of(hn::FixedTag<float, 8>(), hn::Le(near.v, far.v));
}

/// Tests a vector of rays against one box of a node. Returns the rays that meet it, and where they enter it.
HWY_INLINE Bits meet_box(const Bundle& b, std::size_t at, const float* bounds, FN& entry) {
    const DN d;
    const hn::RebindToSigned<DN> di;
    IN near = hn::BitCast(di, hn::Load(d, &b.t_min[at])), far = hn::Load(di, &b.exit[at]);
    for (int a = 0; a < 3; ++a) {
        const MN backward = below(FN::load(&b.direction[a][at]), FN(0.0f));
        const FN lower(bounds[2 * a]), upper(bounds[2 * a + 1]);
        const FN enter = select(backward, upper, lower), leave = select(backward, lower, upper);
        near = hn::Max(
            near, hn::BitCast(di, ((enter - FN::load(&b.near_origin[a][at])) * FN::load(&b.near_inverse[a][at])).v));
        far = hn::Min(far,
                      hn::BitCast(di, ((leave - FN::load(&b.far_origin[a][at])) * FN::load(&b.far_inverse[a][at])).v));
    }
    entry = FN(hn::BitCast(d, near));
    return bits_of(di, hn::Gt(near, far)) ^ ((1u << kLanes) - 1);
}

HWY_INLINE MN mask_of(Bits bits) {
    const hn::RebindToUnsigned<DN> du;
    const auto lane = hn::Iota(hn::RebindToSigned<DN>(), 0);
    const auto one = hn::Shl(hn::Set(du, 1u), hn::BitCast(du, lane));
    return hn::RebindMask(DN(), hn::TestBit(hn::Set(du, bits), one));
}

/// A row of a pair along one of the ray's axes.
struct RowOf {
    FN corner[4];
};

HWY_INLINE RowOf row_of(const Bundle& b, std::size_t k, const vec4* pair, int which) {
    RowOf row;
    const int axis = b.common_axis[k];
    if (axis >= 0) {
        const vec4& r = pair[(axis + 1 + which) % 3];
        for (int c = 0; c < 4; ++c) row.corner[c] = FN(r[c]);
        return row;
    }
    alignas(64) float choice[kLanes];
    for (std::size_t i = 0; i < kLanes; ++i) choice[i] = b.axis[k * kLanes + i];
    const FN axes = FN::load(choice);
    const MN x = hn::Eq(axes.v, FN(0.0f).v), y = hn::Eq(axes.v, FN(1.0f).v);
    for (int c = 0; c < 4; ++c)
        row.corner[c] =
            select(x, FN(pair[(1 + which) % 3][c]), select(y, FN(pair[(2 + which) % 3][c]), FN(pair[which][c])));
    return row;
}

HWY_INLINE MN may_contain_zero(FN a, FN b, FN c) {
    const FN low = least(least(a, b), c), high = most(most(a, b), c), zero(0);
    // For numbers the same as both_may_contain_zero(): some corner is not zero where low or high is not.
    return hn::And(hn::And(hn::Le(low.v, zero.v), hn::Ge(high.v, zero.v)),
                   hn::Or(hn::Ne(low.v, zero.v), hn::Ne(high.v, zero.v)));
}

/// Takes up hits on a triangle of a pair (take()).
template <bool kAny>
HWY_INLINE void take_lanes(const NativeJob& job, Bundle& b, std::size_t k, TriangleOf<FN> triangle, const RowOf& x,
                           const RowOf& y, const vec4* pair, bool second, FN leaf_near, MN met) {
    const DN d;
    const hn::RebindToSigned<DN> di;
    const std::size_t at = k * kLanes;
    const FN zero(0), one(1), inverse_z = FN::load(&b.shear[2][at]);
    const MN flat = hn::And(hn::And(hn::Eq(triangle.edge[0].v, zero.v), hn::Eq(triangle.edge[1].v, zero.v)),
                            hn::Eq(triangle.edge[2].v, zero.v));
    for (FN& edge : triangle.edge) edge = select(flat, one, edge);
    FN near(0.0f);
    for (int i = 0; i < 2; ++i) {
        const RowOf& row = i == 0 ? x : y;
        const FN o = FN::load(&b.origin[i][at]), inverse = FN::load(&b.entry_inverse[i][at]);
        const FN t0 = (row.corner[0] - o) * inverse, t1 = (row.corner[2] - o) * inverse,
                 t2 = (row.corner[second ? 3 : 1] - o) * inverse;
        const FN entry = least(least(t0, t1), t2) - FN::load(&b.entry_error[i][at]);
        near = i == 0 ? entry : most(near, entry);
    }
    PairWords words;
    std::memcpy(&words, &pair[3], sizeof(words));
    const std::uint32_t flags = second ? words.orders >> shared::kBvhAlphaShift : words.orders;
    const bool asks = job.alpha_tested && (flags & shared::kBvhAlphaTested) != 0;
    const std::uint32_t order = second ? words.orders >> shared::kBvhOrderShift : words.orders;
    const FN t_min = FN::load(&b.t_min[at]), asked = FN::load(&b.asked[at]), end = FN::load(&b.t[at]);
    if constexpr (kAny) {
        const FN t = pair_t(triangle, inverse_z);
        const FN after = job.alpha_tested ? point_of(triangle, order, inverse_z).t : t;
        const MN nearer = hn::And(met, hn::And(hn::Gt(after.v, t_min.v), hn::Lt(most(t, near).v, end.v)));
        if (asks) {
            select(nearer, zero, asked).store(&b.asked[at]);
            return;
        }
        b.found |= bits_at(k, bits_of(d, nearer));
        hn::Store(hn::IfThenElse(hn::RebindMask(di, nearer), hn::Set(di, -1), hn::Load(di, &b.exit[at])), di,
                  &b.exit[at]);
    } else {
        const PointOf<FN> p = point_of(triangle, order, inverse_z);
        const FN t = most(p.t, most(near, leaf_near));
        const IN id = hn::Set(di, static_cast<std::int32_t>(words.id[second ? 1 : 0] & shared::kBvhTriangleMask));
        const IN nearest = hn::Load(di, &b.triangle[at]);
        const MN wins_tie = hn::And(hn::Eq(t.v, end.v), hn::RebindMask(d, hn::Lt(id, nearest)));
        const MN nearer = hn::And(met, hn::And(hn::Gt(p.t.v, t_min.v), hn::Or(hn::Lt(t.v, end.v), wins_tie)));
        if (asks) {
            select(nearer, least(asked, t), asked).store(&b.asked[at]);
            return;
        }
        const Bits hit = bits_of(d, nearer);
        if (hit == 0) return;
        b.found |= bits_at(k, hit);
        const FN now = select(nearer, t, end);
        now.store(&b.t[at]);
        select(nearer, p.u, FN::load(&b.u[at])).store(&b.u[at]);
        select(nearer, p.v, FN::load(&b.v[at])).store(&b.v[at]);
        hn::Store(hn::IfThenElse(hn::RebindMask(di, nearer), id, nearest), di, &b.triangle[at]);
        hn::Store(hn::IfThenElse(hn::RebindMask(di, nearer), hn::BitCast(di, t.v), hn::Load(di, &b.exit[at])), di,
                  &b.exit[at]);
    }
}

/// Tests a vector of rays against the pairs of a leaf (test_leaf()).
template <bool kAny>
HWY_INLINE void test_leaf_lanes(const NativeJob& job, Bundle& b, std::size_t k, Bits rays, std::uint32_t leaf,
                                FN leaf_near) {
    const DN d;
    const std::size_t at = k * kLanes;
    const std::uint32_t count = (leaf >> shared::kBvhCountShift) & 7u;
    const vec4* pair = job.pairs + std::size_t{leaf & shared::kBvhIndexMask} * shared::kBvhPairTexels;
    const FN ox = FN::load(&b.origin[0][at]), oy = FN::load(&b.origin[1][at]), oz = FN::load(&b.origin[2][at]);
    const FN sx = FN::load(&b.shear[0][at]), sy = FN::load(&b.shear[1][at]), zero(0);
    const MN asks = mask_of(rays);
    for (std::uint32_t i = 0; i < count; ++i, pair += shared::kBvhPairTexels) {
        const RowOf row_x = row_of(b, k, pair, 0), row_y = row_of(b, k, pair, 1), row_z = row_of(b, k, pair, 2);
        FN x[4], y[4];
        Edges<FN> e;
        for (int c = 0; c < 4; ++c) {
            e.z[c] = row_z.corner[c] - oz;
            x[c] = (row_x.corner[c] - ox) - sx * e.z[c];
            y[c] = (row_y.corner[c] - oy) - sy * e.z[c];
        }
        MN positive[4], negative[4];
        for (int c = 0; c < 4; ++c) {
            const int n = (c + 1) % 4;
            e.ring[c] = x[c] * y[n] - y[c] * x[n];
            positive[c] = hn::Ge(e.ring[c].v, zero.v), negative[c] = hn::Le(e.ring[c].v, zero.v);
        }
        e.across = x[0] * y[2] - y[0] * x[2];
        const MN across_positive = hn::Ge(e.across.v, zero.v), across_negative = hn::Le(e.across.v, zero.v);
        MN first = hn::And(asks, hn::Or(hn::And(hn::And(positive[0], positive[1]), across_negative),
                                        hn::And(hn::And(negative[0], negative[1]), across_positive)));
        MN second = hn::And(asks, hn::Or(hn::And(hn::And(positive[2], positive[3]), across_positive),
                                         hn::And(hn::And(negative[2], negative[3]), across_negative)));
        if (!hn::AllFalse(d, first)) {
            first = hn::And(first, hn::And(may_contain_zero(x[0], x[1], x[2]), may_contain_zero(y[0], y[1], y[2])));
            if (!hn::AllFalse(d, first))
                take_lanes<kAny>(job, b, k, triangle_of(e, false), row_x, row_y, pair, false, leaf_near, first);
        }
        if (!hn::AllFalse(d, second)) {
            second = hn::And(second, hn::And(may_contain_zero(x[2], x[3], x[0]), may_contain_zero(y[2], y[3], y[0])));
            if (!hn::AllFalse(d, second))
                take_lanes<kAny>(job, b, k, triangle_of(e, true), row_x, row_y, pair, true, leaf_near, second);
        }
    }
}

/// Searches one ray of a bundle from a node down, with what has been found so far. `leaf_node` has a leaf in `slot`;
/// null: the search is from the root.
template <class Bound, bool kAny>
HWY_INLINE void search_one(const NativeJob& job, Bundle& b, std::size_t i, std::uint32_t reference, std::int32_t near,
                           StackEntry* stack) {
    const SingleRay ray = single_ray(b, i);
    Search search;
    search.nearest = {b.t[i], b.u[i], b.v[i], static_cast<std::uint32_t>(b.triangle[i]),
                      static_cast<std::uint32_t>(b.instance[i])};
    search.found = ((b.found >> i) & 1) != 0;
    search.asked = b.asked[i];
    if (shared::is_leaf(reference)) {
        test_leaf<kAny>(job, ray, reference, 0, std::bit_cast<float>(near), search);
    } else {
        search_space<Bound, kAny>(job, job.rays[b.path[i]], ray, reference, near, 0,
                                  std::bit_cast<std::int32_t>(ray.t_min), stack, search);
    }
    const std::uint64_t bit = std::uint64_t{1} << i;
    b.t[i] = search.nearest.t, b.u[i] = search.nearest.u, b.v[i] = search.nearest.v;
    b.triangle[i] = static_cast<std::int32_t>(search.nearest.triangle);
    b.instance[i] = static_cast<std::int32_t>(search.nearest.instance);
    b.asked[i] = search.asked;
    if (search.found) b.found |= bit;
    if (search.out_of_range) b.out_of_range |= bit;
    if (!kAny) b.exit[i] = std::bit_cast<std::int32_t>(b.t[i]);
    if ((kAny && search.found) || search.out_of_range) b.exit[i] = -1;
}

/// Returns where the last ray ends, as s of the shaft.
HWY_INLINE float exit_of(const Bundle& b) {
    const hn::RebindToSigned<DN> di;
    FN exit(0);
    for (std::size_t at = 0; at < kBundle; at += kLanes) {
        const FN end = hn::BitCast(DN(), hn::Load(di, &b.exit[at]));
        const MN lives = hn::Ge(end.v, FN(0.0f).v);  // -1 is a NaN
        exit = most(exit, select(lives, end / FN::load(&b.end[at]), FN(0.0f)));
    }
    return std::min(most_lane(exit) * 1.00001f, 1.0f);
}

/// Searches the scene for the rays of a bundle by the shaft. Returns false if it gave up after `most_steps` nodes and
/// leaves; what it has found by then is valid.
template <class Bound, bool kAny>
HWY_INLINE bool search_bundle(const NativeJob& job, Bundle& b, const ShaftTest& shaft, StackEntry* stack,
                              StackEntry* other_stack, int most_steps) {
    const NativeTree& tree = *job.tree;
    const NativeNode<Bound>* const nodes = nodes_of<Bound>(tree);
    const std::uint32_t root = tree.spaces.front().root & shared::kBvhIndexMask;
    StackEntry* top = stack;
    // Entries hold 8 * node + slot of an inner node's child in place of references.
    StackEntry entry = 0;
    bool at_root = true;
    float exit = exit_of(b);
    alignas(32) std::int32_t near[8];
    for (;;) {
        std::uint32_t index = root;
        if (!at_root) {
            if (top == stack) return true;
            entry = *--top;
            if (!kAny && std::bit_cast<float>(static_cast<std::int32_t>(entry >> 32)) > exit) continue;
            const auto place = static_cast<std::uint32_t>(entry);
            const NativeNode<Bound>& parent = nodes[place >> 3];
            const std::uint32_t reference = parent.reference[place & 7];
            if (!shared::is_inner_node(reference)) {
                if (--most_steps < 0) return false;
                float bounds[6];
                for (std::size_t p = 0; p < 6; ++p) bounds[p] = static_cast<float>(parent.bounds[p][place & 7]);
                bool changed = false;
                for (std::size_t k = 0; k < kVectors; ++k) {
                    FN entered;
                    const Bits rays = meet_box(b, k * kLanes, bounds, entered);
                    if (rays == 0) continue;
                    changed = true;
                    if (shared::is_leaf(reference) && std::popcount(rays) > 2) {
                        test_leaf_lanes<kAny>(job, b, k, rays, reference, entered);
                        continue;
                    }
                    alignas(64) float entries[kLanes];
                    entered.store(entries);
                    for (Bits left = rays; left != 0; left &= left - 1) {
                        const auto i = static_cast<std::size_t>(std::countr_zero(left));
                        search_one<Bound, kAny>(job, b, k * kLanes + i, reference,
                                                std::bit_cast<std::int32_t>(entries[i]), other_stack);
                    }
                }
                if (changed) {
                    exit = exit_of(b);
                    if (exit == 0) return true;
                }
                continue;
            }
            index = reference & shared::kBvhIndexMask;
        }
        at_root = false;
        if (--most_steps < 0) return false;
        const NativeNode<Bound>& node = nodes[index];
        StackEntry* const first = top;
        for (Bits met = meet_shaft(node, shaft, exit, near); met != 0; met &= met - 1) {
            const auto i = static_cast<std::uint32_t>(std::countr_zero(met));
            if (node.reference[i] == shared::kBvhNoChild) continue;
            const StackEntry added = stack_entry(near[i], index << 3 | i);
            StackEntry* at = top++;
            for (; at != first && at[-1] < added; --at) at[0] = at[-1];
            *at = added;
        }
    }
}

}  // namespace halflight::rays::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
