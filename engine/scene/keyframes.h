// Keyframes: what moves, sampled at times of its own (glTF 2.0, appendix C).
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace halflight {

enum class Interpolation : std::uint8_t { step, linear, cubic_spline };

/// A sampled function of time whose values have `components` numbers each.
struct Keyframes {
    Interpolation interpolation = Interpolation::linear;
    int components = 1;        // > 0
    bool rotation = false;     // values are unit quaternions x, y, z, w, of four components
    std::vector<float> times;  // seconds, finite, none before the one in front of it; never empty
    // Finite. `components` for each time; of a cubic spline three times that: tangent in, value, tangent out. Tangents
    // are per second.
    std::vector<float> values;
};

/// Throws Error, whose subject is `subject`, for keyframes that are not as their comments say.
void check_keyframes(const Keyframes& keys, std::string_view subject);

/// The value at `seconds`, which is finite, into `out`, of keys.components numbers. Before the first and after the last
/// key it is theirs; of keys at one time the last one counts from that time on. Rotations take the shorter arc and come
/// out as unit quaternions; where there is none (a spline through zero), as the key before.
void sample(const Keyframes& keys, double seconds, std::span<double> out);

}  // namespace halflight
