// The decision whether a scene gets a neutral sky or lamps: what its light shows to its cameras in a small picture.
#pragma once

#include <vector>

#include "engine/rays/scene_probe.h"
#include "engine/scene/scene.h"

namespace halflight {

/// Shares of the points that cameras see, by the light that reaches them.
struct LightShares {
    double visible = 0;  // share of points without own radiance that have kVisible after metering, [0,1]
    double bright = 0;   // share of points that are visible, too, if metering adds at most kMostStops
};

inline constexpr double kVisible = 1.0 / 64;      ///< radiance that is told from black in a picture whose white is 1
inline constexpr double kMostStops = 1;           ///< exposure beyond which a scene lit by a sky is better
inline constexpr double kLeastVisible = 0.5;      ///< share of visible points below which a scene gets light
inline constexpr double kSkyRadiance = 9.0 / 14;  ///< mean radiance of the neutral sky

/// Estimates the shares by paths on the CPU, a fixed number for each scene, and by metered_exposure(). Directional
/// lights, points, spots, emissive triangles with their textures and coverage, and an environment of mean radiance
/// `environment` count. Surfaces reflect diffusely by their base colour, but at least 5 % and at most 80 %.
LightShares light_shares(const rays::SceneProbe& probe, const std::vector<Camera>& cameras, double environment = 0);

/// Returns point lights in the free space that cameras see. They lie between a camera and what it sees, halfway up to
/// the ceiling, as far from surfaces as possible. The intensity of a lamp grows with the square of that distance, so
/// that no surface is burnt out. Together, they give the surfaces in the pictures a median irradiance of pi / 3. Empty
/// if they reach nothing.
std::vector<PunctualLight> room_lamps(const rays::SceneProbe& probe, const std::vector<Camera>& cameras);

/// Light that is to be added to a scene.
struct DefaultLight {
    bool sky = false;                    // a neutral sky
    bool closed = false;                 // too little of a sky can enter
    std::vector<PunctualLight> lamps{};  // room_lamps() of closed scenes
};

/// Returns the light that a scene needs if fewer than kLeastVisible of its points are bright. It is a sky if there is
/// no environment and enough points are bright under the sky. Otherwise it is room_lamps() if too few points are
/// visible, or nothing.
DefaultLight default_light(const rays::SceneProbe& probe, const std::vector<Camera>& cameras, double environment = 0);

}  // namespace halflight
