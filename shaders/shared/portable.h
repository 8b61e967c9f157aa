// Macros that let one header serve C++ (GLM types, sizes asserted) and GLSL 4.50 (std430).
#pragma once

#ifdef __cplusplus
#include "engine/core/math.h"
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
