// Vectors of floats with operators, compiled once per instruction set. Include after hwy/highway.h.
//
// Functions on lanes exist for float, too, so that single values and vectors share code. least() and most() equal the
// driver's min() and max() for numbers. They get no NaN, because in_range() excludes such rays.
#if defined(HALFLIGHT_NATIVE_LANES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HALFLIGHT_NATIVE_LANES_INL
#undef HALFLIGHT_NATIVE_LANES_INL
#else
#define HALFLIGHT_NATIVE_LANES_INL
#endif

#include <bit>
#include <cmath>
#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace halflight::rays::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Bits, one per lane.
using Bits = std::uint32_t;

template <class D>
struct Lanes {
    using V = hn::Vec<D>;
    using T = hn::TFromD<D>;
    static constexpr std::size_t kCount = hn::MaxLanes(D());
    V v;

    Lanes() = default;
    HWY_INLINE Lanes(V value) : v(value) {}
    HWY_INLINE Lanes(T value) : v(hn::Set(D(), value)) {}
    HWY_INLINE static Lanes load(const T* from) { return hn::Load(D(), from); }
    HWY_INLINE void store(T* to) const { hn::Store(v, D(), to); }
};

template <class D>
HWY_INLINE Lanes<D> operator+(Lanes<D> a, Lanes<D> b) {
    return hn::Add(a.v, b.v);
}
template <class D>
HWY_INLINE Lanes<D> operator-(Lanes<D> a, Lanes<D> b) {
    return hn::Sub(a.v, b.v);
}
template <class D>
HWY_INLINE Lanes<D> operator*(Lanes<D> a, Lanes<D> b) {
    return hn::Mul(a.v, b.v);
}
template <class D>
HWY_INLINE Lanes<D> operator/(Lanes<D> a, Lanes<D> b) {
    return hn::Div(a.v, b.v);
}
template <class D>
HWY_INLINE Lanes<D> least(Lanes<D> a, Lanes<D> b) {
    return hn::Min(a.v, b.v);
}
template <class D>
HWY_INLINE Lanes<D> most(Lanes<D> a, Lanes<D> b) {
    return hn::Max(a.v, b.v);
}
template <class D>
HWY_INLINE Lanes<D> magnitude(Lanes<D> a) {
    return hn::Abs(a.v);
}
template <class D>
HWY_INLINE Lanes<D> negated(Lanes<D> a) {
    return hn::Neg(a.v);
}
template <class D>
HWY_INLINE auto below(Lanes<D> a, Lanes<D> b) {
    return hn::Lt(a.v, b.v);
}
template <class D, class M>
HWY_INLINE Lanes<D> select(M mask, Lanes<D> yes, Lanes<D> no) {
    return hn::IfThenElse(mask, yes.v, no.v);
}
template <class M>
HWY_INLINE M both(M a, M b) {
    return hn::And(a, b);
}
template <class M>
HWY_INLINE M but_not(M a, M b) {  // a and not b
    return hn::AndNot(b, a);
}

template <class R>
concept Real = std::same_as<R, float> || std::same_as<R, double>;
template <Real R>
HWY_INLINE R least(R a, R b) {
    return a < b ? a : b;
}
template <Real R>
HWY_INLINE R most(R a, R b) {
    return a > b ? a : b;
}
template <Real R>
HWY_INLINE R magnitude(R a) {
    return std::abs(a);
}
template <Real R>
HWY_INLINE R negated(R a) {
    return -a;
}
HWY_INLINE bool below(float a, float b) {
    return a < b;
}
HWY_INLINE float select(bool mask, float yes, float no) {
    return mask ? yes : no;
}
HWY_INLINE bool both(bool a, bool b) {
    return a && b;
}
HWY_INLINE bool but_not(bool a, bool b) {
    return a && !b;
}

/// Returns a bit for each lane.
template <class D, class M>
HWY_INLINE Bits bits_of(D d, M mask) {
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, mask, bytes);
    return bytes[0] | static_cast<Bits>(bytes[1]) << 8;
}

}  // namespace halflight::rays::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
