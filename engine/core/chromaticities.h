// Primaries and white points of RGB spaces, and the matrices between the spaces.
#pragma once

#include <glm/glm.hpp>
#include <optional>

namespace halflight {

/// CIE 1931 (x, y) chromaticities of an RGB space.
struct Chromaticities {
    glm::dvec2 red, green, blue, white;
};

inline constexpr Chromaticities kRec709{{0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}, {0.3127, 0.3290}};  // ITU-R BT.709-6
inline constexpr Chromaticities kAp1{{0.713, 0.293}, {0.165, 0.830}, {0.128, 0.044}, {0.32168, 0.33767}};  // S-2014-004
inline constexpr Chromaticities kAp0{{0.7347, 0.2653}, {0, 1}, {0.0001, -0.077}, {0.32168, 0.33767}};  // SMPTE 2065-1

/// Returns whether two spaces differ by no more than roundings: files hold coordinates of four digits or floats.
inline bool same_space(const Chromaticities& a, const Chromaticities& b) {
    constexpr double kRounding = 1e-4;
    const auto near = [](const glm::dvec2& p, const glm::dvec2& q) { return glm::distance(p, q) < 2 * kRounding; };
    return near(a.red, b.red) && near(a.green, b.green) && near(a.blue, b.blue) && near(a.white, b.white);
}

/// Returns the chromaticities of a file; none if all are 0, which some programs write for colours that they do not
/// know.
inline std::optional<Chromaticities> known_chromaticities(const Chromaticities& c) {
    const glm::dvec2 zero(0);
    const bool known = c.red != zero || c.green != zero || c.blue != zero || c.white != zero;
    return known ? std::optional(c) : std::nullopt;
}

/// Returns the matrix from linear RGB to CIE XYZ; white (1, 1, 1) gets Y = 1 (SMPTE RP 177-1993).
inline glm::dmat3 rgb_to_xyz(const Chromaticities& c) {
    const auto xyz = [](const glm::dvec2& xy) { return glm::dvec3(xy.x / xy.y, 1, (1 - xy.x - xy.y) / xy.y); };
    const auto direction = [](const glm::dvec2& xy) { return glm::dvec3(xy.x, xy.y, 1 - xy.x - xy.y); };
    const glm::dmat3 primaries(direction(c.red), direction(c.green), direction(c.blue));
    const glm::dvec3 scale = glm::inverse(primaries) * xyz(c.white);
    return glm::dmat3(primaries[0] * scale.x, primaries[1] * scale.y, primaries[2] * scale.z);
}

/// Returns the matrix from linear RGB of one space to linear RGB of another. White maps to white by Bradford adaptation
/// (Lam 1985; ICC.1:2010, annex E).
inline glm::dmat3 rgb_conversion(const Chromaticities& from, const Chromaticities& to) {
    const glm::dmat3 bradford =
        glm::transpose(glm::dmat3(0.8951, 0.2664, -0.1614, -0.7502, 1.7135, 0.0367, 0.0389, -0.0685, 1.0296));
    const glm::dvec3 white_from = bradford * rgb_to_xyz(from) * glm::dvec3(1);
    const glm::dvec3 white_to = bradford * rgb_to_xyz(to) * glm::dvec3(1);
    glm::dmat3 gain(0);
    for (int i = 0; i < 3; ++i) gain[i][i] = white_to[i] / white_from[i];
    return glm::inverse(rgb_to_xyz(to)) * glm::inverse(bradford) * gain * bradford * rgb_to_xyz(from);
}

/// Returns the primaries of the space that linear Rec.709 is converted to by `matrix`; their white is D65. Only
/// matrices that map white to white have such primaries, which make rgb_conversion(kRec709, result) equal the matrix.
inline Chromaticities chromaticities_of(const glm::dmat3& matrix) {
    const glm::dmat3 xyz = rgb_to_xyz(kRec709) * glm::inverse(matrix);  // columns are the primaries
    const auto xy = [](const glm::dvec3& c) { return glm::dvec2(c) / (c.x + c.y + c.z); };
    return {xy(xyz[0]), xy(xyz[1]), xy(xyz[2]), kRec709.white};
}

}  // namespace halflight
