// Blocks of pixels that an adaptive run samples.
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST uint kNoBlock = 0xffffffu;  // SampledBlock::block of paths without pixels

// Flag of SampledBlock::sample_and_half: the sample belongs to the first of the two halves that the denoiser compares.
HALFLIGHT_SHARED_CONST uint kInFirstHalf = 0x80000000u;

// The sample that 256 consecutive paths take: one sample of each pixel of a 16x16 block.
struct SampledBlock {
    uint block;            // number of the block in the order of shaders/shared/pixel_order.h, or kNoBlock
    uint sample_and_half;  // index in the sequences of the block's pixels, < 2^31, and kInFirstHalf
    vec2 jitter;           // Frame::jitter of this sample
};
HALFLIGHT_SHARED_SIZE(SampledBlock, 16)

HALFLIGHT_SHARED_END
