// Whole numbers below 2^29 in rows of floats: as bits of a normal float, which no texture unit flushes or quiets.
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST uint kWordTag = 0x40000000u;
HALFLIGHT_SHARED_CONST uint kWordMask = 0x1fffffffu;

HALFLIGHT_SHARED_FUNCTION float float_of_word(uint word) {
    return uintBitsToFloat(word | kWordTag);
}
HALFLIGHT_SHARED_FUNCTION uint word_of_float(float value) {
    return floatBitsToUint(value) & kWordMask;
}
HALFLIGHT_SHARED_FUNCTION uvec4 words_of_floats(vec4 values) {
    return floatBitsToUint(values) & kWordMask;
}

HALFLIGHT_SHARED_END
