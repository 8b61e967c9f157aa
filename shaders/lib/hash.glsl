// Hashes that decide by identity instead of by order.
#include "shaders/shared/sobol.h"

// Keys the alpha test of one ray: `seed` changes with sample and depth.
uint ray_key(uint path, uint seed) { return hash_combine(hash_u32(seed), path); }
