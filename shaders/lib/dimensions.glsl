// Dimensions of the random numbers that a path uses at its vertex number `depth` (0: the first surface).
#include "shaders/lib/sobol.glsl"
#include "shaders/shared/frame.h"
#include "shaders/shared/pixel_order.h"

const uint kDimensionLight = 1u;      // two-dimensional, bits: choice of a light and point on it
const uint kDimensionLobe = 2u;       // two-dimensional: component, lobe within the glossy one
const uint kDimensionDirection = 3u;  // 2d
const uint kDimensionRoulette = 4u;   // 1d
const uint kDimensionsPerVertex = 5u;

uint vertex_dimension(uint depth, uint which) { return depth * kDimensionsPerVertex + which; }

Sampler path_sampler(Frame frame, uint path) {
    uvec2 pixel = pixel_of_path(path, uvec2(frame.tiles_x, frame.tiles_y)) + uvec2(0u, frame.band_y);
    if (frame.shared_count > 0u)
        return make_shared_sampler(pixel.x, pixel.y, frame.sample_index, frame.shared_count, frame.seed);
    return make_sampler(pixel.x, pixel.y, frame.sample_index, frame.seed);
}
