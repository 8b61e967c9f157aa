// Keys of the alpha tests of a sample's rays. They depend on the pixel of the picture, and therefore not on the bands.
#include "shaders/lib/hash.glsl"
#include "shaders/lib/path_pixel.glsl"

// Returns the key of a pixel of the whole image. `salt` distinguishes the batches of a sample; 0 for camera rays.
uint alpha_key_of_pixel(Frame frame, ivec2 pixel, uint salt) {
    return ray_key(uint(pixel.y) * uint(frame.size.x) + uint(pixel.x), frame.seed, frame.sample_index, salt);
}

uint alpha_key_of_path(Frame frame, uint path, uint salt) {
    ivec2 pixel = ivec2(pixel_in_band(frame, path)) + ivec2(frame.band_x, frame.band_y);
    return alpha_key_of_pixel(frame_of_path(frame, path), pixel, salt);
}
