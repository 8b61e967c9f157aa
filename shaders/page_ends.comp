// Keeps the ends of a batch's rays, for the page queries of the next sample (engine/paging/page_queries.h).
#include "shaders/shared/ray_structs.h"

layout(local_size_x = 64) in;

layout(std430) readonly buffer Hits { Hit hits[]; };
layout(std430) writeonly buffer Ends { float ends[]; };

uniform uint capacity;  // number of rays

void main() {
    uint ray = gl_GlobalInvocationID.x;
    if (ray < capacity) ends[ray] = hits[ray].t;
}
