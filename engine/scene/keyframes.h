// Keyframes and their interpolation (glTF 2.0, appendix C).
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace halflight {

enum class Interpolation : std::uint8_t { step, linear, cubic_spline };

/// A function of time, sampled at keys. Each value has `components` numbers.
struct Keyframes {
    Interpolation interpolation = Interpolation::linear;
    int components = 1;        // > 0
    bool rotation = false;     // values are unit quaternions x, y, z, w; components is 4
    std::vector<float> times;  // seconds, finite, not descending, never empty
    // Finite numbers, `components` per key. A cubic spline has three times as many: in-tangent, value, out-tangent.
    // Tangents are per second.
    std::vector<float> values;
};

/// Throws Error about `subject` for keyframes that break the rules above.
void check_keyframes(const Keyframes& keys, std::string_view subject);

/// Writes the value at `seconds` (finite) to `out`, which has keys.components numbers. The first key's value holds
/// before it, the last key's after it, and that of the last of several keys at one time from then on. Keys are compared
/// as floats, as files store their times. Rotations take the shorter arc and are returned as unit quaternions; where a
/// spline passes through zero, the key before holds.
void sample(const Keyframes& keys, double seconds, std::span<double> out);

}  // namespace halflight
