// Functions whose results differ between C libraries, here made of IEEE arithmetic only: the committed scenes are
// compared byte by byte. (sqrt is correctly rounded everywhere.)
#pragma once

#include <cstdint>

#include "engine/core/math.h"

namespace halflight::scenes {

/// Returns the sine with an error below 2e-16 for |radians| < 1e4.
double sine(double radians);
inline double cosine(double radians) {
    return sine(radians + kPi / 2);
}
/// Returns (cos, sin); exact for multiples of a quarter turn.
dvec2 cos_sin_degrees(double degrees);

/// Returns 32 well-mixed bits of two numbers (Jarzynski, Olano 2020: PCG hash, nested).
std::uint32_t hash(std::uint32_t a, std::uint32_t b = 0);

/// A stream of random numbers that is the same on every machine, unlike std::uniform_real_distribution.
class Random {
  public:
    explicit Random(std::uint32_t seed) : key_(hash(seed)) {}
    double operator()() { return hash(key_, counter_++) * 0x1p-32; }  ///< Returns a uniform number in [0, 1).
    double in(double low, double high) { return low + (high - low) * (*this)(); }
    int below(int count) { return static_cast<int>((*this)() * count); }  ///< Returns 0 to count - 1.

  private:
    std::uint32_t key_;
    std::uint32_t counter_ = 0;
};

}  // namespace halflight::scenes
