// Owen-scrambled Sobol points, one copy for C++ and GLSL: padded pairs of the first two Sobol dimensions with shuffled
// indices (Burley 2020, Practical Hash-based Owen Scrambling, JCGT 9(4)). The Laine-Karras hash has the constants of
// Vegdahl 2021, "Building a Better LK Hash". All arithmetic is on 32-bit integers, so the bits are equal everywhere.
#pragma once

#include "shaders/shared/pixel_order.h"
#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

// Returns a well-mixing permutation of 32-bit words (Wellons 2018, "Prospecting for Hash Functions", lowbias32).
HALFLIGHT_SHARED_FUNCTION uint hash_u32(uint v) {
    v ^= v >> 16;
    v *= 0x7feb352du;
    v ^= v >> 15;
    v *= 0x846ca68bu;
    return v ^ (v >> 16);
}

// Combines two hashes; their order matters.
HALFLIGHT_SHARED_FUNCTION uint hash_combine(uint seed, uint v) {
    return hash_u32(seed ^ (v * 0x9e3779b9u + 0x85ebca6bu));
}

// Applies nested uniform scrambling to a bit-reversed number: every bit is flipped by a hash of the bits below it.
HALFLIGHT_SHARED_FUNCTION uint scramble_reversed(uint v, uint seed) {
    v ^= v * 0x3d20adeau;
    v += seed;
    v *= (seed >> 16) | 1u;
    v ^= v * 0x05526c56u;
    return v ^ (v * 0x53a22864u);
}

// Returns the second Sobol dimension, bit-reversed. Its generator matrix is Pascal's triangle modulo 2 (Sobol 1967). By
// Lucas' theorem that is the fifth Kronecker power of (1 1; 0 1): one butterfly stage per factor instead of 32 columns.
HALFLIGHT_SHARED_FUNCTION uint sobol_second_reversed(uint index) {
    index ^= (index >> 1) & 0x55555555u;
    index ^= (index >> 2) & 0x33333333u;
    index ^= (index >> 4) & 0x0f0f0f0fu;
    index ^= (index >> 8) & 0x00ff00ffu;
    return index ^ (index >> 16);
}

// Key of one sample's points: dimensions of one seed are mutually shuffled (0,2)-sequences in the index.
struct Sampler {
    uint seed;   // seed of pixel and frame
    uint index;  // sample number
};

HALFLIGHT_SHARED_FUNCTION Sampler make_sampler(uint pixel_x, uint pixel_y, uint sample_index, uint frame_seed) {
    Sampler s;
    s.seed = hash_combine(hash_combine(hash_u32(frame_seed), pixel_x), pixel_y);
    s.index = sample_index;
    return s;
}

// Permutes aligned blocks of 2^k numbers as a whole, and all smaller ones within them.
HALFLIGHT_SHARED_FUNCTION uint nested_shuffle(uint v, uint seed) {
    return bitfieldReverse(scramble_reversed(bitfieldReverse(v), seed));
}

// Returns the sampler of one sequence shared by all pixels, which take `count` consecutive samples each (a power of 2),
// in a randomly nested Morton order. Points of neighbours complement each other, so that errors cancel from pixel to
// pixel and look like blue noise (Ahmed and Wonka 2020, Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error
// via Hierarchical Ordering of Pixels). The points of a single pixel are as well distributed as in its own sequence.
// sample_index < count; coordinates < 2^16. The points of 2^32 / count pixels differ. If samples are split, this
// number is smaller by the factor of Estimator::shadow.
HALFLIGHT_SHARED_FUNCTION Sampler make_shared_sampler(uint pixel_x, uint pixel_y, uint sample_index, uint count,
                                                      uint frame_seed) {
    uint place = morton_spread(pixel_x) | (morton_spread(pixel_y) << 1);
    Sampler s;
    s.seed = hash_u32(frame_seed);
    s.index = nested_shuffle(place, hash_u32(s.seed + 1u)) * count + sample_index;
    return s;
}

HALFLIGHT_SHARED_FUNCTION uint shuffled_index(Sampler s, uint seed) {
    return nested_shuffle(s.index, seed);
}

// Returns fixed-point numbers in [0, 1) with 32 bits after the point. `dimension` may be any number; each is an
// independent stream.
HALFLIGHT_SHARED_FUNCTION uint sample_1d_bits(Sampler s, uint dimension) {
    uint seed = hash_combine(s.seed, dimension);
    return bitfieldReverse(scramble_reversed(shuffled_index(s, seed), hash_u32(seed + 1u)));
}

struct SampleBits {
    uint x;
    uint y;
};

HALFLIGHT_SHARED_FUNCTION SampleBits sample_2d_bits(Sampler s, uint dimension) {
    uint seed = hash_combine(s.seed, dimension);
    uint index = shuffled_index(s, seed);
    SampleBits bits;
    bits.x = bitfieldReverse(scramble_reversed(index, hash_u32(seed + 1u)));
    bits.y = bitfieldReverse(scramble_reversed(sobol_second_reversed(index), hash_u32(seed + 2u)));
    return bits;
}

// Returns a number in [0, 1) in steps of 2^-24, so that it never rounds up to 1.
HALFLIGHT_SHARED_FUNCTION float unit_float(uint bits) {
    return float(bits >> 8) * (1.0f / 16777216.0f);
}

// Returns the part of `choice` that a decision for `u` in [low, low + share) leaves: 32 bits, uniform and still
// stratified. `u` is a number of unit_float() from the choice times `entries`. A hash fills the bits below its
// resolution: 2^-32 per entry, or 2^-24, over the share.
HALFLIGHT_SHARED_FUNCTION uint left_of_choice(uint choice, uint entries, float u, float low, float share) {
    if (entries == 1u && share == 1.0f) return choice;  // there was no decision
    float steps = (entries > 256u ? float(entries) : 256.0f) / share;
    uint mask = (2u << uint(findMSB(uint(steps < 1e9f ? steps : 1e9f)))) - 1u;
    float left = (u - low) / share;
    left = left > 0.0f ? left : 0.0f;
    uint rest = uint((left < 1.0f ? left : 0.99999994f) * 4294967296.0f);
    return (rest & ~mask) | (hash_u32(choice) & mask);
}

HALFLIGHT_SHARED_FUNCTION float sample_1d(Sampler s, uint dimension) {
    return unit_float(sample_1d_bits(s, dimension));
}

HALFLIGHT_SHARED_FUNCTION vec2 sample_2d(Sampler s, uint dimension) {
    SampleBits bits = sample_2d_bits(s, dimension);
    return vec2(unit_float(bits.x), unit_float(bits.y));
}

HALFLIGHT_SHARED_END
