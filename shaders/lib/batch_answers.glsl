// The answers to the rays of a batch: their hits, or with HALFLIGHT_ANY_HIT whether they have any. This file binds
// them.
#include "shaders/lib/finite.glsl"
#include "shaders/shared/ray_structs.h"

const bool kAnyHit = HALFLIGHT_ANY_HIT != 0;
OPTIONAL(HALFLIGHT_ANY_HIT) layout(std430) buffer Occluded { uint occluded[]; };
OPTIONAL(!HALFLIGHT_ANY_HIT) layout(std430) buffer Hits { Hit hits[]; };

// Stores the result of traverse().
void store_answer(uint path, Hit hit) {
    if (kAnyHit) {
        bool finished = floatBitsToUint(hit.t) != floatBitsToUint(not_a_number());
        occluded[path] = hit.triangle == kMiss ? kFree : finished ? kOccluded : kUnfinished;
    } else {
        hits[path] = hit;
    }
}
