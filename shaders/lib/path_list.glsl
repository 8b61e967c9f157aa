// Appending to a list of paths, tile by tile: the paths of one work group stay together and in order. The order of
// groups is arbitrary, and no result depends on it.
#include "shaders/shared/ray_structs.h"

shared uint append_mask[2];
shared uint append_base;

struct AppendRank {
    uint rank;   // rank of this invocation among those of its group that append
    uint total;  // number of invocations that append
};

// Returns the ranks. The function contains barriers: all 64 invocations of the group must call it.
AppendRank rank_in_group(bool wanted) {
    uint lane = gl_LocalInvocationIndex;
    barrier();  // all invocations have read earlier values
    if (lane < 2u) append_mask[lane] = 0u;
    barrier();
    if (wanted) atomicOr(append_mask[lane >> 5], 1u << (lane & 31u));
    barrier();
    uint low = append_mask[0];
    uint high = append_mask[1];
    uint below = (1u << (lane & 31u)) - 1u;
    return AppendRank(uint(lane < 32u ? bitCount(low & below) : bitCount(low) + bitCount(high & below)),
                      uint(bitCount(low) + bitCount(high)));
}

// Defines `uint name(bool wanted)`: the invocation's place in the list whose ListHeader is the block member `header`.
// DEFINE_APPEND is a macro, because atomics take no function arguments. The function contains barriers.
#define DEFINE_APPEND(name, header)                                                                    \
    uint name(bool wanted) {                                                                           \
        AppendRank r = rank_in_group(wanted);                                                          \
        if (gl_LocalInvocationIndex == 0u) {                                                           \
            append_base = atomicAdd(header.count, r.total);                                            \
            atomicMax(header.groups_x, (append_base + r.total + 63u) / 64u);                           \
        }                                                                                              \
        barrier();                                                                                     \
        return append_base + r.rank;                                                                   \
    }
