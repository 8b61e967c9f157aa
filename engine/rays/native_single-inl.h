// Traversal of the eight-wide hierarchy by one ray. Compiled once per instruction set.
#if defined(HALFLIGHT_NATIVE_SINGLE_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HALFLIGHT_NATIVE_SINGLE_INL
#undef HALFLIGHT_NATIVE_SINGLE_INL
#else
#define HALFLIGHT_NATIVE_SINGLE_INL
#endif

#include "engine/rays/native_pairs-inl.h"
#include "engine/rays/native_rays-inl.h"

HWY_BEFORE_NAMESPACE();
namespace halflight::rays::HWY_NAMESPACE {

using I8 = hn::Vec<hn::FixedTag<std::int32_t, 8>>;

/// An entry of the stack: bits of the ray's entry (a float >= 0) above, and the reference. So entries compare by entry.
using StackEntry = std::uint64_t;
HWY_INLINE StackEntry stack_entry(std::int32_t near, std::uint32_t reference) {
    return static_cast<StackEntry>(static_cast<std::uint32_t>(near)) << 32 | reference;
}

HWY_INLINE F8 planes(const std::array<std::uint16_t, 8>& cells) {
    const hn::FixedTag<std::int32_t, 8> d;
    return hn::ConvertTo(hn::FixedTag<float, 8>(),
                         hn::PromoteTo(d, hn::Load(hn::FixedTag<std::uint16_t, 8>(), cells.data())));
}
HWY_INLINE F8 planes(const std::array<float, 8>& bounds) {
    return F8::load(bounds.data());
}

/// Constants of a ray for tests against eight boxes.
struct BoxTest {
    F8 near_origin[3], near_inverse[3], far_origin[3], far_inverse[3];
    std::size_t enter[3];  // indices of NativeNode::bounds
    HWY_INLINE explicit BoxTest(const SingleRay& ray) {
        for (int a = 0; a < 3; ++a) {
            near_origin[a] = F8(ray.at.near_origin[a]), near_inverse[a] = F8(ray.at.near_inverse[a]);
            far_origin[a] = F8(ray.at.far_origin[a]), far_inverse[a] = F8(ray.at.far_inverse[a]);
            enter[a] = ray.enter[a];
        }
    }
};

HWY_INLINE I8 int_bits(F8 v) {
    return hn::BitCast(hn::FixedTag<std::int32_t, 8>(), v.v);
}

/// Tests the children of a node against [t_min, t_exit] (hits_between()). Returns a bit for each child that is met.
template <class Bound>
HWY_INLINE Bits meet(const NativeNode<Bound>& node, const BoxTest& box, I8 t_min, I8 t_exit, std::int32_t* near_out) {
    const hn::FixedTag<std::int32_t, 8> d;
    I8 near[3], far[3];
    for (int a = 0; a < 3; ++a) {
        near[a] = int_bits((planes(node.bounds[box.enter[a]]) - box.near_origin[a]) * box.near_inverse[a]);
        far[a] = int_bits((planes(node.bounds[box.enter[a] ^ 1]) - box.far_origin[a]) * box.far_inverse[a]);
    }
    const I8 enter = hn::Max(hn::Max(near[0], near[1]), hn::Max(near[2], t_min));
    const I8 leave = hn::Min(hn::Min(far[0], far[1]), hn::Min(far[2], t_exit));
    hn::Store(enter, d, near_out);
    return bits_of(d, hn::Gt(enter, leave)) ^ 0xffu;
}

template <class Bound>
HWY_INLINE const NativeNode<Bound>* nodes_of(const NativeTree& tree) {
    if constexpr (std::same_as<Bound, float>)
        return tree.float_nodes.data();
    else
        return tree.grid_nodes.data();
}

template <class Bound>
HWY_INLINE std::size_t node_count(const NativeTree& tree) {
    return std::same_as<Bound, float> ? tree.float_nodes.size() : tree.grid_nodes.size();
}

/// Sets the constants of a ray in the block of an instance (ray_in_block()). Returns false if it is out of range.
HWY_INLINE bool enter_block(const NativeTree& tree, const shared::Ray& ray, std::uint32_t instance, SingleRay& inside) {
    const std::array<vec4, 3>& rows = tree.world_to_block[instance];
    float origin[3], direction[3];
    for (std::size_t i = 0; i < 3; ++i) {
        const vec4& m = rows[i];
        origin[i] = m.x * ray.origin.x + m.y * ray.origin.y + m.z * ray.origin.z + m.w;
        direction[i] = m.x * ray.direction.x + m.y * ray.direction.y + m.z * ray.direction.z;
    }
    const NativeSpace& space = tree.spaces[tree.instance_space[instance]];
    set_constants(inside.at, origin, direction, space, ray.t_min, tree.format == NodeFormat::grid);
    inside.finish();
    return in_range(origin, direction, inside.at.error, space.slack, ray.t_min);
}

template <class Bound, bool kAny>
bool search_instance(const NativeJob& job, const shared::Ray& world_ray, std::uint32_t reference, std::int32_t entered,
                     StackEntry* stack, Search& search);

/// Searches a space for the ray. The stack grows from `stack`. Returns true if the search of the ray ends.
template <class Bound, bool kAny>
bool search_space(const NativeJob& job, const shared::Ray& world_ray, const SingleRay& ray, std::uint32_t root,
                  std::int32_t root_near, std::uint32_t instance, std::int32_t instance_near, StackEntry* stack,
                  Search& search) {
    const NativeNode<Bound>* const nodes = nodes_of<Bound>(*job.tree);
    const hn::FixedTag<std::int32_t, 8> d;
    const BoxTest box(ray);
    const I8 t_min = hn::Set(d, std::bit_cast<std::int32_t>(ray.at.t_min));
    std::int32_t exit = std::bit_cast<std::int32_t>(search.nearest.t);
    if (kAny) exit = static_cast<std::int32_t>(static_cast<std::uint32_t>(exit) - 1u);
    StackEntry* top = stack;
    *top++ = stack_entry(root_near, root);
    alignas(32) std::int32_t near[8];
    while (top != stack) {
        StackEntry entry = *--top;
        if (!kAny && static_cast<std::int32_t>(entry >> 32) > exit) continue;
        while (shared::is_inner_node(static_cast<std::uint32_t>(entry))) {
            const NativeNode<Bound>& node = nodes[entry & shared::kBvhIndexMask];
            Bits met = meet(node, box, t_min, hn::Set(d, exit), near);
            entry = 0;
            if (met == 0) break;
            const auto next = [&]() HWY_ATTR {
                const auto i = static_cast<std::size_t>(std::countr_zero(met));
                met &= met - 1;
                return stack_entry(near[i], node.reference[i]);
            };
            if constexpr (kAny) {
                // Children are in the order of any hits. The first one is next.
                const auto first = static_cast<std::size_t>(std::countr_zero(met));
                met &= met - 1;
                while (met != 0) {
                    const auto i = static_cast<std::size_t>(31 - std::countl_zero(met));
                    met ^= 1u << i;
                    *top++ = stack_entry(near[i], node.reference[i]);
                }
                entry = stack_entry(near[first], node.reference[first]);
                continue;
            }
            entry = next();
            if (met == 0) continue;
            const StackEntry second = next(), other = std::max(entry, second);
            entry = std::min(entry, second);
            if (met == 0) {
                *top++ = other;
                continue;
            }
            // Entries are sorted, the nearest one at the top.
            StackEntry* const first = top;
            *top++ = other;
            *top++ = entry;
            do {
                const StackEntry added = next();
                StackEntry* at = top++;
                for (; at != first && at[-1] < added; --at) at[0] = at[-1];
                *at = added;
            } while (met != 0);
            entry = *--top;
        }
        const auto reference = static_cast<std::uint32_t>(entry);
        if (reference == 0) continue;
        const auto entered = static_cast<std::int32_t>(entry >> 32);
        if (reference < (shared::kBvhTag | shared::kBvhInstance)) {
            const float leaf_near = std::bit_cast<float>(std::max(entered, instance_near));
            if (job.slivers ? test_leaf_in_doubles<kAny>(job, ray, reference, instance, leaf_near, search)
                            : test_leaf<kAny>(job, ray, reference, instance, leaf_near, search))
                return true;
        } else {
            if (search_instance<Bound, kAny>(job, world_ray, reference, entered, top, search)) return true;
        }
        if (!kAny) exit = std::bit_cast<std::int32_t>(search.nearest.t);
    }
    return false;
}

/// Searches the block of an instance, which the ray enters at `entered`. Returns true if the search of the ray ends.
template <class Bound, bool kAny>
bool search_instance(const NativeJob& job, const shared::Ray& world_ray, std::uint32_t reference, std::int32_t entered,
                     StackEntry* stack, Search& search) {
    const std::uint32_t instance = reference & shared::kBvhIndexMask;
    SingleRay inside;
    search.out_of_range = !enter_block(*job.tree, world_ray, instance, inside);
    if (search.out_of_range) return true;
    const NativeSpace& space = job.tree->spaces[job.tree->instance_space[instance]];
    return search_space<Bound, kAny>(job, world_ray, inside, space.root, entered, instance, entered, stack, search);
}

/// Constants of up to 64 rays, one after the other.
class SingleRays {
  public:
    HWY_INLINE SingleRays(const NativeJob& job, const NativeSpace& space, const std::uint32_t* paths,
                          std::size_t count) {
        const RayRows rows(job, paths, count);
        for (std::size_t k = 0, at = 0; at < count; ++k, at += kLanes) {
            const DN d;
            FN origin[3], direction[3], t_min, t_max;
            rows.load(at, origin, t_min, direction, t_max);
            RayConstants<FN> c;
            set_constants(c, origin, direction, space, t_min, job.tree->format == NodeFormat::grid);
            const auto* const from = reinterpret_cast<const FN*>(&c);
            for (std::size_t g = 0; g < kGroups; ++g)
                hn::StoreInterleaved4(from[4 * g].v, from[4 * g + 1].v, from[4 * g + 2].v, from[4 * g + 3].v, d,
                                      &groups_[g][4 * at]);
            t_max.store(&t_max_[at]);
            const Bits lives = bits_of(d, hn::Ge(t_max.v, t_min.v));
            const Bits ranged = bits_of(d, in_range(origin, direction, c.error, space.slack, t_min));
            live_ |= bits_at(k, lives & ranged);
            out_of_range_ |= bits_at(k, lives & ~ranged);
        }
    }
    bool lives(std::size_t i) const { return (live_ >> i & 1) != 0; }
    bool out_of_range(std::size_t i) const { return (out_of_range_ >> i & 1) != 0; }
    float t_max(std::size_t i) const { return t_max_[i]; }
    HWY_INLINE SingleRay ray(std::size_t i) const {
        SingleRay ray;
        for (std::size_t g = 0; g < kGroups; ++g)
            std::memcpy(reinterpret_cast<float*>(&ray.at) + 4 * g, &groups_[g][4 * i], 4 * sizeof(float));
        ray.finish();
        return ray;
    }

  private:
    static constexpr std::size_t kGroups = RayConstants<float>::kCount / 4;
    alignas(64) std::array<std::array<float, 4 * kBundle>, kGroups> groups_;  // four constants of each ray
    alignas(64) std::array<float, kBundle> t_max_;
    std::uint64_t live_ = 0, out_of_range_ = 0;  // a bit per ray
};

}  // namespace halflight::rays::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
