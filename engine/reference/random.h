// Pseudo-random numbers of the oracle, deliberately unrelated to the engine's low-discrepancy sequences.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

namespace halflight::reference {

/// Mixes bits by the finalizer of SplitMix64 (Steele, Lea, Flood 2014), a bijection that behaves like a random one.
inline std::uint64_t mix_bits(std::uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

inline std::uint64_t combine(std::uint64_t a, std::uint64_t b) {
    return mix_bits(a + 0x9e3779b97f4a7c15u + mix_bits(b + 0x9e3779b97f4a7c15u));
}

/// Converts the 53 leading bits to a number in [0, 1).
inline double to_unit(std::uint64_t bits) {
    return static_cast<double>(bits >> 11) * 0x1p-53;
}

/// The generator xoshiro256++ (Blackman, Vigna 2021).
class Random {
  public:
    explicit Random(std::uint64_t key) {
        for (std::uint64_t& word : state_) word = mix_bits(key += 0x9e3779b97f4a7c15u);
    }

    std::uint64_t bits() {
        const std::uint64_t result = std::rotl(state_[0] + state_[3], 23) + state_[0];
        const std::uint64_t shifted = state_[1] << 17;
        state_[2] ^= state_[0];
        state_[3] ^= state_[1];
        state_[1] ^= state_[2];
        state_[0] ^= state_[3];
        state_[2] ^= shifted;
        state_[3] = std::rotl(state_[3], 45);
        return result;
    }

    double uniform() { return to_unit(bits()); }  ///< Returns a number in [0, 1).

  private:
    std::array<std::uint64_t, 4> state_;
};

}  // namespace halflight::reference
