// Bundles of rays, a ray per lane: their constants, and their tests against boxes and pairs of triangles, with the
// arithmetic of the plain tracer. Compiled once per instruction set.
#if defined(HALFLIGHT_NATIVE_BUNDLE_RAYS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HALFLIGHT_NATIVE_BUNDLE_RAYS_INL
#undef HALFLIGHT_NATIVE_BUNDLE_RAYS_INL
#else
#define HALFLIGHT_NATIVE_BUNDLE_RAYS_INL
#endif

#include "engine/rays/native_pairs-inl.h"
#include "engine/rays/native_rays-inl.h"

HWY_BEFORE_NAMESPACE();
namespace halflight::rays::HWY_NAMESPACE {

/// Greatest number of rays that go on one by one.
inline constexpr int kFew = 2;

template <class T>
using BundleRow = std::array<T, kBundle>;

/// Up to 64 rays, an array element each. The last vector is padded with dead rays.
struct alignas(64) Bundle : RayConstants<BundleRow<float>> {
    template <class T>
    using Row = BundleRow<T>;
    Row<float> world_origin[3];
    Row<std::int32_t> exit;     // bits of the end of the search; less than t_min: the ray is done
    Row<float> t, u, v, asked;  // members of Search (native_pairs-inl.h)
    Row<std::int32_t> triangle, instance;
    Row<float> end;  // T: parameter of the ray's end, > 0, for the shaft
    Row<std::uint32_t> path;
    std::array<int, kVectors> common_axis;                // `axis` of all rays of a vector; -1: they differ
    std::size_t count = 0;                                // rays
    std::uint64_t found = 0, out_of_range = 0, live = 0;  // a bit per ray

    RayConstants<BundleRow<float>>& constants() { return *this; }
};

/// Sets the constants of all rays, and which of them live.
HWY_INLINE void set_rays(Bundle& b, const NativeJob& job, const NativeSpace& space, const std::uint32_t* paths,
                         std::size_t count) {
    const RayRows rays(job, paths, count);
    b.count = count;
    for (std::size_t i = 0; i < kBundle; ++i) b.path[i] = paths[std::min(i, count - 1)];
    const DN d;
    const hn::RebindToSigned<DN> di;
    const bool on_grid = job.tree->format == NodeFormat::grid;
    b.found = b.out_of_range = b.live = 0;
    for (std::size_t k = 0, at = 0; k < kVectors; ++k, at += kLanes) {
        FN origin[3], direction[3], t_min, t_max;
        rays.load(at, origin, t_min, direction, t_max);
        RayConstants<FN> c;
        set_constants(c, origin, direction, space, t_min, on_grid);
        for (int a = 0; a < 3; ++a) origin[a].store(&b.world_origin[a][at]);
        const FN zero(0);
        const auto* const from = reinterpret_cast<const FN*>(&c);
        auto* const to = reinterpret_cast<BundleRow<float>*>(&b.constants());
        for (std::size_t r = 0; r < c.kCount; ++r) from[r].store(&to[r][at]);
        t_max.store(&b.t[at]);
        FN(kInfinity).store(&b.asked[at]);
        zero.store(&b.u[at]), zero.store(&b.v[at]);
        hn::Store(hn::Zero(di), di, &b.triangle[at]);
        hn::Store(hn::Zero(di), di, &b.instance[at]);
        const MN good = in_range(origin, direction, c.error, space.slack, t_min), started = hn::Ge(t_max.v, t_min.v);
        const Bits lives = bits_of(d, started), ranged = bits_of(d, good);
        b.live |= bits_at(k, lives & ranged);
        b.out_of_range |= bits_at(k, lives & ~ranged);
        IN exit = hn::BitCast(di, t_max.v);
        if (job.any_hit) exit = hn::Sub(exit, hn::Set(di, 1));
        hn::Store(hn::IfThenElse(hn::RebindMask(di, hn::And(good, started)), exit, hn::Set(di, -1)), di, &b.exit[at]);
        const float axis = b.axis[at];
        b.common_axis[k] = hn::AllTrue(d, hn::Eq(c.axis.v, FN(axis).v)) ? static_cast<int>(axis) : -1;
    }
    const std::uint64_t all = count == kBundle ? ~std::uint64_t{0} : (std::uint64_t{1} << count) - 1;
    b.live &= all, b.out_of_range &= all;
    for (std::size_t i = count; i < kBundle; ++i) b.exit[i] = -1;
}

/// The box of a node's child, for tests against vectors of rays.
struct ChildBox {
    FN lower[3], upper[3];
    template <class Bound>
    HWY_INLINE ChildBox(const NativeNode<Bound>& node, std::size_t child) {
        for (std::size_t a = 0; a < 3; ++a) {
            lower[a] = FN(static_cast<float>(node.bounds[2 * a][child]));
            upper[a] = FN(static_cast<float>(node.bounds[2 * a + 1][child]));
        }
    }
};

/// Tests a vector of rays against a box. Returns the rays that meet it, and where they enter it.
HWY_INLINE Bits meet_box(const Bundle& b, std::size_t at, const ChildBox& box, FN& entry) {
    const DN d;
    const hn::RebindToSigned<DN> di;
    IN near = hn::BitCast(di, hn::Load(d, &b.t_min[at])), far = hn::Load(di, &b.exit[at]);
    for (int a = 0; a < 3; ++a) {
        const FN inverse = FN::load(&b.near_inverse[a][at]);  // negative just where direction < 0; positive for -0
        const FN enter = hn::IfNegativeThenElse(inverse.v, box.upper[a].v, box.lower[a].v);
        const FN leave = hn::IfNegativeThenElse(inverse.v, box.lower[a].v, box.upper[a].v);
        near = hn::Max(near, hn::BitCast(di, ((enter - FN::load(&b.near_origin[a][at])) * inverse).v));
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
    const FN axes = FN::load(&b.axis[k * kLanes]);
    const MN x = hn::Eq(axes.v, FN(0.0f).v), y = hn::Eq(axes.v, FN(1.0f).v);
    for (int c = 0; c < 4; ++c)
        row.corner[c] =
            select(x, FN(pair[(1 + which) % 3][c]), select(y, FN(pair[(2 + which) % 3][c]), FN(pair[which][c])));
    return row;
}

/// Records hits on a triangle of a pair, as take() does for a single ray.
template <bool kAny>
HWY_INLINE void take_lanes(const NativeJob& job, Bundle& b, std::size_t k, TriangleOf<FN> triangle, const RowOf& x,
                           const RowOf& y, const vec4* pair, bool second, FN leaf_near, MN met) {
    const DN d;
    const hn::RebindToSigned<DN> di;
    const std::size_t at = k * kLanes;
    const FN zero(0), one(1), inverse_z = FN::load(&b.shear[2][at]);
    const FN edges = triangle.edge[0] + triangle.edge[1] + triangle.edge[2];
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
    const std::uint32_t flags = second ? words.orders >> shared::kBvhFlagShift : words.orders;
    if (job.passes_panes && is_pane(flags)) return;
    const bool asks = job.alpha_tested && (flags & shared::kBvhAlphaTested) != 0;
    const std::uint32_t order = second ? words.orders >> shared::kBvhOrderShift : words.orders;
    if (job.backfaces != 0 && (flags & shared::kBvhOneSided) != 0) {
        const MN up = hn::Gt(edges.v, zero.v), away = hn::Gt(inverse_z.v, zero.v);
        MN back = turned(second, order, flags) ? hn::Xor(up, away) : hn::Not(hn::Xor(up, away));
        back = hn::And(back, hn::Ne(edges.v, zero.v));
        if (job.backfaces == shared::kMarkedRays) back = hn::And(back, hn::Gt(FN::load(&b.t_min[at]).v, zero.v));
        met = hn::AndNot(back, met);
        if (hn::AllFalse(d, met)) return;
    }
    const FN t_min = FN::load(&b.t_min[at]), asked = FN::load(&b.asked[at]), end = FN::load(&b.t[at]);
    if constexpr (kAny) {
        const FN t = pair_t(triangle, inverse_z);
        const bool by_point = job.alpha_tested || job.backfaces != 0;
        const FN after = by_point ? point_of(triangle, order, inverse_z).t : t;
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

}  // namespace halflight::rays::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
