// Hashes for decisions that depend on ids, not on order.
#include "shaders/shared/sobol.h"

// Returns the key of one ray's alpha test; `seed` changes with sample and depth.
uint ray_key(uint ray, uint seed) { return hash_combine(hash_u32(seed), ray); }

// Returns the key of a ray of one sample; see shaders/lib/alpha_key.glsl.
uint ray_key(uint ray, uint seed, uint sample_index, uint salt) {
    return ray_key(ray, hash_combine(hash_combine(seed, sample_index), salt));
}
