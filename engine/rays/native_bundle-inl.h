// Traversal of the eight-wide hierarchy by up to 64 rays at once. Compiled once per instruction set.
//
// Inner nodes are tested against the chord shaft of the bundle, as in shaders/lib/shaft.glsl. A box moves linearly, s
// in [0, 1], from the box of the rays' origins to the box of their ends. This test costs as much as that of one ray.
// The shaft is wider than all errors, so that no leaf is lost. At leaves each ray is tested by itself
// (native_bundle_rays-inl.h). Any hits are searched in tiles (native_tile-inl.h).
#if defined(HALFLIGHT_NATIVE_BUNDLE_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HALFLIGHT_NATIVE_BUNDLE_INL
#undef HALFLIGHT_NATIVE_BUNDLE_INL
#else
#define HALFLIGHT_NATIVE_BUNDLE_INL
#endif

#include "engine/rays/native_bundle_rays-inl.h"
#include "engine/rays/native_single-inl.h"

HWY_BEFORE_NAMESPACE();
namespace halflight::rays::HWY_NAMESPACE {

HWY_INLINE SingleRay single_ray(Bundle& b, std::size_t i) {
    SingleRay ray;
    const auto* const from = reinterpret_cast<const BundleRow<float>*>(&b.constants());
    auto* const to = reinterpret_cast<float*>(&ray.at);
    for (std::size_t r = 0; r < ray.at.kCount; ++r) to[r] = from[r][i];
    ray.finish();
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
        // A plane whose slope is lost in rounding gets a small one that opens the shaft, so that its inverse is finite.
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

/// Returns what has been found for a ray.
HWY_INLINE Search search_of(const Bundle& b, std::size_t i) {
    Search search;
    search.nearest = {b.t[i], b.u[i], b.v[i], static_cast<std::uint32_t>(b.triangle[i]),
                      static_cast<std::uint32_t>(b.instance[i])};
    search.found = ((b.found >> i) & 1) != 0;
    search.out_of_range = ((b.out_of_range >> i) & 1) != 0;
    search.asked = b.asked[i];
    return search;
}

/// Searches one ray of a bundle below a reference, which it enters at `near`, with what has been found so far.
template <class Bound, bool kAny>
HWY_INLINE void search_one(const NativeJob& job, Bundle& b, std::size_t i, std::uint32_t reference, std::int32_t near,
                           StackEntry* stack) {
    const SingleRay ray = single_ray(b, i);
    Search search = search_of(b, i);
    if (shared::is_leaf(reference)) {
        test_leaf<kAny>(job, ray, reference, 0, std::bit_cast<float>(near), search);
    } else {
        search_space<Bound, kAny>(job, job.rays[b.path[i]], ray, reference, near, 0,
                                  std::bit_cast<std::int32_t>(ray.at.t_min), stack, search);
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
        const MN lives = hn::Ge(end.v, FN(0.0f).v);  // false for -1, whose bits are those of a NaN
        exit = most(exit, select(lives, end / FN::load(&b.end[at]), FN(0.0f)));
    }
    return std::min(most_lane(exit) * 1.00001f, 1.0f);
}

/// Searches the scene for closest hits of the rays of a bundle by the shaft. Returns false if it gave up after
/// `most_steps` nodes and leaves; what it has found by then is valid.
template <class Bound>
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
            if (std::bit_cast<float>(static_cast<std::int32_t>(entry >> 32)) > exit) continue;
            const auto place = static_cast<std::uint32_t>(entry);
            const NativeNode<Bound>& parent = nodes[place >> 3];
            const std::uint32_t reference = parent.reference[place & 7];
            if (!shared::is_inner_node(reference)) {
                if (--most_steps < 0) return false;
                const ChildBox box(parent, place & 7);
                bool changed = false;
                for (std::size_t k = 0; k < kVectors; ++k) {
                    FN entered;
                    const Bits rays = meet_box(b, k * kLanes, box, entered);
                    if (rays == 0) continue;
                    changed = true;
                    if (shared::is_leaf(reference) && std::popcount(rays) > kFew) {
                        test_leaf_lanes<false>(job, b, k, rays, reference, entered);
                        continue;
                    }
                    alignas(64) float entries[kLanes];
                    entered.store(entries);
                    for (Bits left = rays; left != 0; left &= left - 1) {
                        const auto i = static_cast<std::size_t>(std::countr_zero(left));
                        search_one<Bound, false>(job, b, k * kLanes + i, reference,
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

/// Finds the closest hits of up to 64 rays together, or one by one after too many nodes and leaves.
template <class Bound>
void trace_bundle(const NativeJob& job, const std::uint32_t* paths, std::size_t count, StackEntry* stack,
                  StackEntry* other_stack, std::vector<std::uint32_t>& delegated) {
    constexpr int kMostSteps = 200;
    const NativeSpace& space = job.tree->spaces.front();
    Bundle b;
    set_rays(b, job, space, paths, count);
    ShaftTest shaft;
    const bool whole = b.live != 0 && make_shaft(b, space, job.tree->format == NodeFormat::grid, shaft) &&
                       search_bundle<Bound>(job, b, shaft, stack, other_stack, kMostSteps);
    if (!whole) {
        for (std::uint64_t left = b.live; left != 0; left &= left - 1) {
            const auto i = static_cast<std::size_t>(std::countr_zero(left));
            if (b.exit[i] >= 0)
                search_one<Bound, false>(job, b, i, space.root, std::bit_cast<std::int32_t>(b.t_min[i]), stack);
        }
    }
    for (std::size_t i = 0; i < count; ++i) put(job, paths[i], search_of(b, i), delegated);
}

}  // namespace halflight::rays::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
