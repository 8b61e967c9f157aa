// The constants of rays, as in shaders/lib/box.glsl, intersect.glsl and traverse.glsl: equal operations in equal order.
// Compiled once per instruction set.
#if defined(HALFLIGHT_NATIVE_RAY_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HALFLIGHT_NATIVE_RAY_INL
#undef HALFLIGHT_NATIVE_RAY_INL
#else
#define HALFLIGHT_NATIVE_RAY_INL
#endif

#include "engine/rays/native_lanes-inl.h"
#include "engine/rays/native_tree.h"
#include "shaders/shared/bvh_nodes.h"

HWY_BEFORE_NAMESPACE();
namespace halflight::rays::HWY_NAMESPACE {

/// Constants of a ray, or of one ray per lane or array element. Arrays without other notice are by axis.
template <class F>
struct RayConstants {
    static constexpr std::size_t kCount = 28;

    // BoxRay
    F near_origin[3], near_inverse[3], far_origin[3], far_inverse[3];
    F direction[3];
    // TriangleRay and EntryRay, in the order of axes: the last one is that of the largest component
    F origin[3];
    F shear[3];
    F entry_inverse[2], entry_error[2];
    F error;  // position_error()
    F axis;   // axis of the largest component, as TriangleRay::axes.z
    F t_min;
};

static_assert(sizeof(RayConstants<float>) == RayConstants<float>::kCount * sizeof(float));

template <class F>
HWY_INLINE void set_constants(RayConstants<F>& ray, const F* origin, const F* direction, const NativeSpace& space,
                              F t_min, bool on_grid) {
    ray.t_min = t_min;
    F size[3], raised[3], side[3];
    for (int a = 0; a < 3; ++a) {
        size[a] = magnitude(direction[a]);
        side[a] = select(below(direction[a], F(0.0f)), F(-1.0f), F(1.0f));
        ray.direction[a] = direction[a];
    }
    const F smallest = most(size[0], most(size[1], size[2])) * F(9.094947017729282e-13f);
    F reach[3];
    for (int a = 0; a < 3; ++a) {
        raised[a] = side[a] * most(size[a], smallest);
        const float upper = space.base[a] + shared::kGridCells * space.cell[a];
        reach[a] = most(magnitude(F(space.base[a]) - origin[a]), magnitude(F(upper) - origin[a]));
    }
    ray.error = F(space.slack) * most(reach[0], most(reach[1], reach[2]));
    for (int a = 0; a < 3; ++a) {
        F error = side[a] * ray.error, start = origin[a], inverse = F(1.0f) / raised[a];
        if (on_grid) {
            const F cell(space.cell[a]);
            start = (origin[a] - F(space.base[a])) / cell;
            inverse = cell / raised[a];
            error = error / cell;
        }
        ray.near_origin[a] = start + error;
        ray.far_origin[a] = start - error;
        ray.near_inverse[a] = inverse * F(0.99999904632568359f);  // 1 -+ 2^-20
        ray.far_inverse[a] = inverse * F(1.0000009536743164f);
    }

    const auto x_first = both(below(size[1], size[0]), below(size[2], size[0]));
    const auto y_first = but_not(below(size[2], size[1]), x_first);
    ray.axis = select(x_first, F(0.0f), select(y_first, F(1.0f), F(2.0f)));
    const auto in_order = [&](const F* v, int k) HWY_ATTR {
        return select(x_first, v[(k + 1) % 3], select(y_first, v[(k + 2) % 3], v[k]));
    };
    F along[3];
    for (int k = 0; k < 3; ++k) {
        ray.origin[k] = in_order(origin, k);
        along[k] = in_order(direction, k);
    }
    const F inverse = F(1.0f) / along[2];
    ray.shear[0] = along[0] * inverse;
    ray.shear[1] = along[1] * inverse;
    ray.shear[2] = inverse;
    for (int k = 0; k < 2; ++k) {
        ray.entry_inverse[k] = F(1.0f) / in_order(raised, k);
        ray.entry_error[k] = (F(0.25f) * ray.error) * magnitude(ray.entry_inverse[k]);
    }
}

/// Returns whether the ray has no NaN and all intermediate results are finite, in this space and with these limits of
/// t. The reach is at most 2^40, and raised components of the direction are from 2^-80 to 2^40.
HWY_INLINE bool in_range(const float* origin, const float* direction, float error, float slack, float t_min) {
    float size = 0;
    for (int k = 0; k < 3; ++k) {  // one by one, because a maximum may hide NaN
        if (std::isnan(origin[k]) || !(std::abs(direction[k]) <= 0x1p40f)) return false;
        size = std::max(size, std::abs(direction[k]));
    }
    return size >= 0x1p-40f && error <= slack * 0x1p40f && t_min >= 0;
}

/// One ray, with what its traversal takes from it.
struct SingleRay {
    RayConstants<float> at;
    std::size_t enter[3];  // indices of NativeNode::bounds; the ray leaves at `enter ^ 1`
    int axes[3];           // TriangleRay::axes

    /// Sets what follows from the constants.
    HWY_INLINE void finish() {
        for (std::size_t a = 0; a < 3; ++a) enter[a] = 2 * a + (at.direction[a] < 0 ? 1 : 0);
        axes[2] = static_cast<int>(at.axis);
        axes[0] = axes[2] == 2 ? 0 : axes[2] + 1;
        axes[1] = axes[2] == 0 ? 2 : axes[2] - 1;
    }
};

}  // namespace halflight::rays::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
