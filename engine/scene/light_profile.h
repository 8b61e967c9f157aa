// Measured distributions of the light of lamps, by direction.
#pragma once

#include <string>
#include <vector>

#include "engine/core/math.h"

namespace halflight {

struct PunctualLight;

/// Luminous intensity of a lamp by direction, as IES LM-63 files of photometric type C have it. The vertical angle is
/// that from PunctualLight::direction. The horizontal angle turns about it, from PunctualLight::right to
/// PunctualLight::up. Between entries the share is bilinear in both angles.
struct LightProfile {
    std::string name{};               // name for users
    std::string path{};               // file, as an edit names it; empty: of the scene's file
    std::vector<float> vertical{};    // radians, [0, pi], ascending, two or more; beyond them the lamp is dark
    std::vector<float> horizontal{};  // radians, ascending from 0 to 2 pi; 0 alone: all horizontal angles are alike
    std::vector<float> shares{};      // intensity / `candela`, [0, 1]: all vertical angles of each horizontal one
    float candela = 0;                // greatest intensity, cd
    bool operator==(const LightProfile&) const = default;
};

/// Returns the mean share over all directions, exactly.
double mean_share(const LightProfile& profile);

/// A cone about the direction of a lamp that holds all its light.
struct LitCone {
    double angle = kPi;     // radians, half the opening, (0, pi]
    double share = 0;       // mean share over its directions
    bool reversed = false;  // the cone opens against the direction
};
LitCone lit_cone(const LightProfile& profile);

/// Sets the axes of a lamp to those of a transform: its direction is -Z; right and up are X and Y, made orthogonal
/// to it. Axes that the transform collapses are replaced by others.
void set_profile_axes(PunctualLight& light, const dmat3& to_world);

/// Turns right and up with the direction, on the shortest way from `before` to light.direction.
void turn_profile_axes(PunctualLight& light, const vec3& before);

}  // namespace halflight
