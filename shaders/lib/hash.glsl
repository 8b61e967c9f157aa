// Hashes that decide by identity instead of by order.
#include "shaders/shared/sobol.h"

// Keys the alpha test of one ray: `seed` changes with sample and depth.
uint ray_key(uint ray, uint seed) { return hash_combine(hash_u32(seed), ray); }

// Of a ray of one sample: shaders/lib/alpha_key.glsl.
uint ray_key(uint ray, uint seed, uint sample_index, uint salt) {
    return ray_key(ray, hash_combine(hash_combine(seed, sample_index), salt));
}
