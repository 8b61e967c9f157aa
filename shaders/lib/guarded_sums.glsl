// Sums over samples, without values that are no light. Include after the kernel's `frame`, and after
// `buffer ... { uint bad_values[kCountedPasses * kBadKinds]; }`.

// Returns the sum so far. It is 0 at the first sample, where the buffer may hold an earlier frame.
double so_far(double sum) { return frame.begins != 0u ? 0.0lf : sum; }
#define ADD(sum, value) sum = so_far(sum) + double(value)

uint how_many(bvec3 b) { return uint(b.x) + uint(b.y) + uint(b.z); }

// Counts the bad values of v (NaN, infinite, below `least`) for the pass, and returns v with them replaced. `least` is
// 0 or -kLargestFloat.
vec3 guarded(vec3 v, float least, uint pass) {
    uvec3 magnitude = floatBitsToUint(v) & 0x7fffffffu;
    bvec3 infinite = equal(magnitude, uvec3(0x7f800000u));
    bvec3 nan = greaterThan(magnitude, uvec3(0x7f800000u));
    v = mix(v, vec3(0.0), bvec3(uvec3(infinite) | uvec3(nan)));
    // Signs are tested by bits, because hardware flushes denormal numbers to zero.
    bvec3 below = least == 0.0 ? greaterThan(floatBitsToUint(v), uvec3(0x80000000u)) : bvec3(false);
    uvec3 bad = uvec3(how_many(nan), how_many(infinite), how_many(below));
    // A loop without iterations costs nothing, unlike a branch not taken.
    for (uint kind = 0u; kind < (bad == uvec3(0u) ? 0u : kBadKinds); ++kind)
        if (bad[kind] > 0u) atomicAdd(bad_values[pass * kBadKinds + kind], bad[kind]);
    return max(v, vec3(least));
}
vec3 guarded(vec3 radiance, uint pass) { return guarded(radiance, 0.0, pass); }
