// Whole numbers below 2^29 in rows of floats: as bits of a normal float, which no texture unit flushes or quiets.
#pragma once

#include "shaders/shared/portable.h"

#ifdef __cplusplus
#include <bit>
#endif

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST uint kWordTag = 0x40000000u;
HALFLIGHT_SHARED_CONST uint kWordMask = 0x1fffffffu;

#ifdef __cplusplus
inline float float_of_word(uint word) {
    return std::bit_cast<float>(word | kWordTag);
}
inline uint word_of_float(float value) {
    return std::bit_cast<uint>(value) & kWordMask;
}
#else
float float_of_word(uint word) {
    return uintBitsToFloat(word | kWordTag);
}
uint word_of_float(float value) {
    return floatBitsToUint(value) & kWordMask;
}
uvec4 words_of_floats(vec4 values) {
    return floatBitsToUint(values) & kWordMask;
}
#endif

HALFLIGHT_SHARED_END
