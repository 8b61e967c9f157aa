// Lets one header serve C++ (GLM types, sizes asserted) and GLSL 4.50 (std430): macros, and built-in functions of GLSL.
#pragma once

#ifdef __cplusplus
#include <bit>
#include <cmath>

#include "engine/core/math.h"

namespace halflight::shared {

using glm::abs, glm::clamp, glm::cos, glm::dot, glm::exp, glm::length, glm::log2, glm::max, glm::min, glm::mix,
    glm::pow;
using glm::floatBitsToUint, glm::round, glm::sin, glm::sqrt, glm::uintBitsToFloat;
using std::abs;

inline std::uint32_t bitfieldReverse(std::uint32_t v) {
    v = (v >> 16) | (v << 16);
    v = ((v >> 8) & 0x00ff00ffu) | ((v & 0x00ff00ffu) << 8);
    v = ((v >> 4) & 0x0f0f0f0fu) | ((v & 0x0f0f0f0fu) << 4);
    v = ((v >> 2) & 0x33333333u) | ((v & 0x33333333u) << 2);
    return ((v >> 1) & 0x55555555u) | ((v & 0x55555555u) << 1);
}
inline int findMSB(std::uint32_t v) {
    return std::bit_width(v) - 1;
}

}  // namespace halflight::shared

#define HALFLIGHT_SHARED_BEGIN    \
    namespace halflight::shared { \
    using uint = std::uint32_t;
#define HALFLIGHT_SHARED_END }
#define HALFLIGHT_SHARED_SIZE(type, bytes) static_assert(sizeof(type) == bytes);
#define HALFLIGHT_SHARED_CONST inline constexpr
#define HALFLIGHT_SHARED_FUNCTION inline
#define HALFLIGHT_SHARED_PRECISE
#else
#define HALFLIGHT_SHARED_BEGIN
#define HALFLIGHT_SHARED_END
#define HALFLIGHT_SHARED_SIZE(type, bytes)
#define HALFLIGHT_SHARED_CONST const
#define HALFLIGHT_SHARED_FUNCTION
#define HALFLIGHT_SHARED_PRECISE precise
#endif
