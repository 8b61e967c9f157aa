// Hashes that decide by identity instead of by order.
#include "shaders/shared/sobol.h"

// Keys the alpha test of one ray: `seed` changes with sample and depth.
uint ray_key(uint path, uint seed) { return hash_combine(hash_u32(seed), path); }

// Of a ray of one sample. salt: tells the batches of a sample apart; 0 are camera rays.
uint ray_key(uint path, uint seed, uint sample_index, uint salt) {
    return ray_key(path, hash_combine(hash_combine(seed, sample_index), salt));
}
