// Pixel and sample of a path. In most samples, each path has a pixel of its own. In adaptive runs, a list names the
// block of pixels and the sample of 256 paths each.
#include "shaders/shared/frame_block.h"
#include "shaders/shared/pixel_order.h"
#include "shaders/shared/sampled_block.h"

const bool kSampledBlocks = HALFLIGHT_SAMPLED_BLOCKS != 0;  // a list names the blocks
uniform usamplerBuffer sampled_blocks;                      // RGBA32UI: SampledBlock

SampledBlock sampled_block(uint path) {
    uvec4 texel = texelFetch(sampled_blocks, int(path >> 8));
    return SampledBlock(texel.x, texel.y, uintBitsToFloat(texel.zw));
}
// Returns the path of the band's own order that has the same pixel.
uint path_in_band(uint path) { return kSampledBlocks ? (sampled_block(path).block << 8) | (path & 255u) : path; }
// Returns the constants of the path's own sample.
Frame frame_of_path(Frame frame, uint path) {
    if (kSampledBlocks) {
        SampledBlock block = sampled_block(path);
        frame.sample_index = block.sample_and_half & ~kInFirstHalf;
        frame.jitter = block.jitter;
        frame.first_half = (block.sample_and_half & kInFirstHalf) != 0u ? 1u : 0u;
    }
    return frame;
}

// Returns the pixel relative to the band's first row; it may be outside the picture.
uvec2 pixel_in_band(Frame frame, uint path) {
    return pixel_of_path(path_in_band(path), uvec2(frame.tiles_x, frame.tiles_y));
}
