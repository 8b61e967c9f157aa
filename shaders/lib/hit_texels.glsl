// Hits by path, read as texels, which are faster than storage blocks on llvmpipe.
#include "shaders/shared/ray_structs.h"

uniform usamplerBuffer hits;  // R32UI, the five words of each Hit

uint hit_word(uint path, uint word) { return texelFetch(hits, int(5u * path + word)).x; }

Hit load_hit(uint path) {
    return Hit(uintBitsToFloat(hit_word(path, 0u)), uintBitsToFloat(hit_word(path, 1u)),
               uintBitsToFloat(hit_word(path, 2u)), hit_word(path, 3u), hit_word(path, 4u));
}
