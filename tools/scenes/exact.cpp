#include "tools/scenes/exact.h"

#include <cmath>

namespace halflight::scenes {

double sine(double radians) {
    const double half_turns = std::floor(radians / kPi + 0.5);
    const double x = radians - half_turns * kPi, xx = x * x;  // |x| <= pi / 2: sin(x) = +-sin(radians)
    double term = x, sum = 0;
    for (int i = 1; i <= 23; i += 2) {  // Taylor series; the first omitted term is (pi/2)^25 / 25! < 1e-20
        sum += term;
        term *= -xx / ((i + 1) * (i + 2));
    }
    return std::fmod(half_turns, 2) == 0 ? sum : -sum;
}

dvec2 cos_sin_degrees(double degrees) {
    const double quarters = degrees / 90;
    if (quarters != std::floor(quarters)) return {cosine(degrees * kPi / 180), sine(degrees * kPi / 180)};
    static constexpr double kCos[] = {1, 0, -1, 0};
    const int i = static_cast<int>(std::fmod(std::fmod(quarters, 4) + 4, 4));
    return {kCos[i], kCos[(i + 3) % 4]};
}

std::uint32_t hash(std::uint32_t a, std::uint32_t b) {
    const auto pcg = [](std::uint32_t v) {
        v = v * 747796405U + 2891336453U;
        v = ((v >> ((v >> 28U) + 4U)) ^ v) * 277803737U;
        return (v >> 22U) ^ v;
    };
    return pcg(a + pcg(b));
}

}  // namespace halflight::scenes
