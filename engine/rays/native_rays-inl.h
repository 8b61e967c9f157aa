// Up to 64 rays at a time, a ray per lane: how they are read, and their constants. Compiled once per instruction set.
#if defined(HALFLIGHT_NATIVE_RAYS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HALFLIGHT_NATIVE_RAYS_INL
#undef HALFLIGHT_NATIVE_RAYS_INL
#else
#define HALFLIGHT_NATIVE_RAYS_INL
#endif

#include "engine/rays/native_ray-inl.h"
#include "engine/rays/native_trace.h"

HWY_BEFORE_NAMESPACE();
namespace halflight::rays::HWY_NAMESPACE {

inline constexpr std::size_t kBundle = 64;

using FN = Lanes<hn::CappedTag<float, 16>>;
using DN = hn::CappedTag<float, 16>;
using IN = hn::Vec<hn::CappedTag<std::int32_t, 16>>;
using MN = hn::Mask<DN>;
inline constexpr std::size_t kLanes = FN::kCount;
inline constexpr std::size_t kVectors = kBundle / kLanes;

HWY_INLINE std::uint64_t bits_at(std::size_t vector, Bits bits) {
    return std::uint64_t{bits} << (vector * kLanes);
}

/// Rays in memory, in the order of a list. The last vector is padded with copies of the last ray.
class RayRows {
  public:
    HWY_INLINE RayRows(const NativeJob& job, const std::uint32_t* paths, std::size_t count) {
        for (std::size_t i = 0; i < kBundle; ++i) {
            const shared::Ray& ray = job.rays[paths[std::min(i, count - 1)]];
            std::memcpy(&starts_[4 * i], &ray.origin, sizeof(vec4));
            std::memcpy(&ends_[4 * i], &ray.direction, sizeof(vec4));
        }
    }
    HWY_INLINE void load(std::size_t at, FN* origin, FN& t_min, FN* direction, FN& t_max) const {
        const DN d;
        hn::LoadInterleaved4(d, &starts_[4 * at], origin[0].v, origin[1].v, origin[2].v, t_min.v);
        hn::LoadInterleaved4(d, &ends_[4 * at], direction[0].v, direction[1].v, direction[2].v, t_max.v);
    }

  private:
    alignas(64) std::array<float, 4 * kBundle> starts_, ends_;  // origin, t_min; direction, t_max
};
static_assert(sizeof(shared::Ray) == 2 * sizeof(vec4));

/// Returns the rays that are in_range().
HWY_INLINE MN in_range(const FN* origin, const FN* direction, FN error, float slack, FN t_min) {
    MN good = hn::And(hn::Le(error.v, FN(slack * 0x1p40f).v), hn::Ge(t_min.v, FN(0.0f).v));
    FN size(0.0f);
    for (int k = 0; k < 3; ++k) {
        const FN along = magnitude(direction[k]);
        good = hn::And(good, hn::And(hn::Eq(origin[k].v, origin[k].v), hn::Le(along.v, FN(0x1p40f).v)));
        size = most(size, along);
    }
    return hn::And(good, hn::Ge(size.v, FN(0x1p-40f).v));
}

}  // namespace halflight::rays::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
