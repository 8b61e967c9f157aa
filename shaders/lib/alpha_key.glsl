// Keys of the alpha tests of a sample's rays. They depend on the pixel of the picture, and therefore not on the bands.
#include "shaders/lib/hash.glsl"
#include "shaders/shared/frame.h"
#include "shaders/shared/pixel_order.h"

// Returns the key of a pixel of the whole image. `salt` distinguishes the batches of a sample; 0 for camera rays.
uint alpha_key_of_pixel(Frame frame, ivec2 pixel, uint salt) {
    return ray_key(uint(pixel.y) * uint(frame.size.x) + uint(pixel.x), frame.seed, frame.sample_index, salt);
}

uint alpha_key_of_path(Frame frame, uint path, uint salt) {
    ivec2 pixel = ivec2(pixel_of_path(path, uvec2(frame.tiles_x, frame.tiles_y)));
    return alpha_key_of_pixel(frame, pixel + ivec2(0, frame.band_y), salt);
}
