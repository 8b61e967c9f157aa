// Dimensions of the random numbers that a path uses at its vertex number `depth` (0: the first surface).
#include "shaders/lib/path_pixel.glsl"
#include "shaders/lib/sobol.glsl"

const uint kDimensionLens = 0u;       // two-dimensional, at the first surface only: point of the aperture
const uint kDimensionLight = 1u;      // two-dimensional, bits: choice of a light and point on it
const uint kDimensionLobe = 2u;       // two-dimensional: component, lobe within the glossy one
const uint kDimensionDirection = 3u;  // 2d
const uint kDimensionRoulette = 4u;   // 1d
const uint kDimensionsPerVertex = 5u;

uint vertex_dimension(uint depth, uint which) { return depth * kDimensionsPerVertex + which; }

// Returns the sampler of a pixel of the whole image.
Sampler pixel_sampler(Frame frame, uvec2 pixel) {
    if (frame.shared_count > 0u)
        return make_shared_sampler(pixel.x & 0xffffu, pixel.y & 0xffffu, frame.sample_index, frame.shared_count, frame.seed);
    return make_sampler(pixel.x, pixel.y, frame.sample_index, frame.seed);
}

Sampler path_sampler(Frame frame, uint path) {
    return pixel_sampler(frame_of_path(frame, path), pixel_in_band(frame, path) + uvec2(frame.band_x, frame.band_y));
}
