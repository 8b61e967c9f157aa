#include "engine/scene/keyframes.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "engine/core/error.h"
#include "engine/core/math.h"

namespace halflight {
namespace {

dvec4 quaternion(const double* values) {
    return {values[0], values[1], values[2], values[3]};
}

void store(const dvec4& q, std::span<double> out) {
    for (int i = 0; i < 4; ++i) out[static_cast<std::size_t>(i)] = q[i];
}

/// Interpolates spherically along the shorter arc (glTF 2.0, appendix C.4; Shoemake 1985). `a` and `b` are unit.
dvec4 slerp(const dvec4& a, dvec4 b, double t) {
    double cosine = glm::dot(a, b);
    if (cosine < 0) b = -b, cosine = -cosine;
    // Below this angle the chord equals the arc within rounding, and the division by its sine is avoided.
    constexpr double kNearlyOne = 1 - 1e-12;
    if (cosine > kNearlyOne) return glm::normalize(glm::mix(a, b, t));
    const double angle = std::acos(cosine);
    return glm::normalize((std::sin((1 - t) * angle) * a + std::sin(t * angle) * b) / std::sin(angle));
}

/// Returns `q` normalised, or `otherwise` if `q` is zero.
dvec4 unit(const dvec4& q, const dvec4& otherwise) {
    return q == dvec4(0) ? otherwise : glm::normalize(q);
}

/// Returns how many numbers a key has.
std::size_t stride(const Keyframes& keys) {
    return static_cast<std::size_t>(keys.components) * (keys.interpolation == Interpolation::cubic_spline ? 3 : 1);
}

/// Returns the value of key k.
std::span<const float> value(const Keyframes& keys, std::size_t k) {
    const auto n = static_cast<std::size_t>(keys.components);
    const std::size_t tangent = keys.interpolation == Interpolation::cubic_spline ? n : 0;
    return std::span(keys.values).subspan(k * stride(keys) + tangent, n);
}

dvec4 rotation(const Keyframes& keys, std::size_t k) {
    const auto v = value(keys, k);
    return unit({v[0], v[1], v[2], v[3]}, {0, 0, 0, 1});
}

void take_key(const Keyframes& keys, std::size_t k, std::span<double> out) {
    if (keys.rotation) return store(rotation(keys, k), out);
    std::ranges::copy(value(keys, k), out.begin());
}

/// Evaluates the Hermite spline between keys k and k + 1, `span` seconds apart (glTF 2.0, appendix C.5).
void take_spline(const Keyframes& keys, std::size_t k, double t, double span, std::span<double> out) {
    const auto n = static_cast<std::size_t>(keys.components);
    const float* const tangent_out = &keys.values[k * stride(keys) + 2 * n];
    const float* const tangent_in = &keys.values[(k + 1) * stride(keys)];
    const auto from = value(keys, k), to = value(keys, k + 1);
    const double t2 = t * t, t3 = t2 * t;
    for (std::size_t i = 0; i < n; ++i)
        out[i] = (2 * t3 - 3 * t2 + 1) * from[i] + span * (t3 - 2 * t2 + t) * tangent_out[i] +
                 (-2 * t3 + 3 * t2) * to[i] + span * (t3 - t2) * tangent_in[i];
    if (keys.rotation) store(unit(quaternion(out.data()), rotation(keys, k)), out);
}

}  // namespace

void check_keyframes(const Keyframes& keys, std::string_view subject) {
    if (keys.times.empty()) throw Error(subject, "has no keys");
    if (keys.rotation && keys.components != 4)
        throw Error(subject, "a rotation has 4 numbers, not {}", keys.components);
    for (std::size_t k = 0; k < keys.times.size(); ++k) {
        if (!std::isfinite(keys.times[k])) throw Error(subject, "the time of key {} is not finite", k);
        if (k > 0 && keys.times[k] < keys.times[k - 1])
            throw Error(subject, "key {} at {} s comes after one at {} s", k, keys.times[k], keys.times[k - 1]);
    }
    const std::size_t expected = keys.times.size() * stride(keys);
    if (keys.values.size() != expected)
        throw Error(subject, "{} numbers for {} keys of {}", keys.values.size(), keys.times.size(), stride(keys));
    const auto bad = std::ranges::find_if(keys.values, [](float v) { return !std::isfinite(v); });
    if (bad != keys.values.end())
        throw Error(subject, "key {} is not finite",
                    static_cast<std::size_t>(bad - keys.values.begin()) / stride(keys));
}

void sample(const Keyframes& keys, double seconds, std::span<double> out) {
    assert(out.size() == static_cast<std::size_t>(keys.components) && std::isfinite(seconds));
    // Finds the first later key. The one before it is the last of the keys at its time. Files round times to float: a
    // key at frame 1 of 24 per second is 1e-9 s later than 1/24 s.
    const auto later = std::ranges::upper_bound(keys.times, static_cast<float>(seconds));
    if (later == keys.times.begin()) return take_key(keys, 0, out);
    const auto k = static_cast<std::size_t>(later - keys.times.begin()) - 1;
    if (later == keys.times.end() || keys.interpolation == Interpolation::step) return take_key(keys, k, out);
    const double begin = keys.times[k], span = keys.times[k + 1] - begin;
    const double t = std::clamp((seconds - begin) / span, 0.0, 1.0);
    if (keys.interpolation == Interpolation::cubic_spline) return take_spline(keys, k, t, span, out);
    if (keys.rotation) return store(slerp(rotation(keys, k), rotation(keys, k + 1), t), out);
    const auto from = value(keys, k), to = value(keys, k + 1);
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = from[i] + t * (double{to[i]} - from[i]);
}

}  // namespace halflight
