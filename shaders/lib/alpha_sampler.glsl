// Random numbers of the alpha tests of a sample's rays. They depend on the pixel of the picture, and therefore not on
// the bands.
#include "shaders/lib/dimensions.glsl"

// Returns the sampler of a pixel of the whole image, whose dimensions are those of alpha_accept(). `salt` < 2^31
// distinguishes the batches of a sample; 0 for camera rays.
Sampler alpha_sampler_of_pixel(Frame frame, uvec2 pixel, uint salt) {
    Sampler s = pixel_sampler(frame, pixel);
    s.seed = hash_combine(s.seed, 0x80000000u | salt);  // beyond the dimensions of paths
    return s;
}

Sampler alpha_sampler_of_path(Frame frame, uint path, uint salt) {
    uvec2 pixel = pixel_in_band(frame, path) + uvec2(frame.band_x, frame.band_y);
    return alpha_sampler_of_pixel(frame_of_path(frame, path), pixel, salt);
}
