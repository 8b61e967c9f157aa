// GLM's types in our namespace, and the few operations that GLM lacks.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <limits>

namespace halflight {

using glm::dmat3, glm::dmat4, glm::dvec2, glm::dvec3, glm::dvec4;
using glm::ivec2, glm::ivec3, glm::ivec4;
using glm::mat3, glm::mat4;
using glm::uvec2, glm::uvec3, glm::uvec4;
using glm::vec2, glm::vec3, glm::vec4;

inline constexpr float kInfinity = std::numeric_limits<float>::infinity();
inline constexpr double kPi = 3.14159265358979323846;

/// Axis-aligned box; empty (lower > upper) until something is added.
struct Bounds {
    vec3 lower{kInfinity};
    vec3 upper{-kInfinity};

    void add(const vec3& p) { lower = glm::min(lower, p), upper = glm::max(upper, p); }
    void add(const Bounds& b) { lower = glm::min(lower, b.lower), upper = glm::max(upper, b.upper); }
    bool empty() const { return lower.x > upper.x; }
    vec3 centre() const { return 0.5f * lower + 0.5f * upper; }
    vec3 extent() const { return empty() ? vec3(0) : upper - lower; }
};

/// Returns the relative luminance of linear Rec.709 radiance (ITU-R BT.709-6, item 3.2).
inline float luminance(const vec3& c) {
    return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z;
}

inline bool all_finite(const vec3& v) {
    return !glm::any(glm::isnan(v)) && !glm::any(glm::isinf(v));
}

}  // namespace halflight
