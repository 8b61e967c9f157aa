// The decision whether a scene gets a neutral sky or lamps: what its own light, and what a sky, would show to its
// cameras.
#pragma once

#include <vector>

#include "engine/rays/scene_probe.h"
#include "engine/scene/scene.h"

namespace halflight {

/// Light of the surface points that cameras see, points that glow left out.
struct LightShares {
    double lit = 0;  // share of points at which the scene's own light is not negligible, [0,1]
    double sky = 0;  // irradiance over pi by a sky of radiance 1, at the points that are not lit; mean over all points
};

/// Irradiance over pi below which a surface counts as dark: a hundredth of what a whole sky of radiance 1 gives. Where
/// glowing surfaces, such as labels or screens, take a larger share of what cameras see than exposure ignores
/// (kGlowingShare), they keep the exposure low, so more is dark.
inline constexpr double kNegligibleLight = 0.01, kNegligibleBesideEmission = 0.05;
/// Limit that replaces kNegligibleBesideEmission where all light comes from emissive textures of at most 1. Labels,
/// screens and glow maps without KHR_materials_emissive_strength are meant to look white, not to light a scene.
inline constexpr double kNegligibleBesideDisplays = 0.2;
/// Radiance from which a surface glows, so that no sky need light it: that of a grey surface under a sky.
inline constexpr double kGlow = 0.18;
inline constexpr double kGlowingShare = 0.05;
/// A neutral sky is added where a smaller share is lit, and the sky would give all points a mean of at least kLeastSky.
/// In a scene without any light, cameras get lamps where it would give less.
inline constexpr double kLitShare = 0.1;
inline constexpr double kLeastSky = 0.02;

/// Estimates the shares by paths on the CPU, a fixed number for each scene. Directional lights, points, spots, emissive
/// triangles and their textures count; surfaces reflect half of the light.
LightShares light_shares(const Scene& scene, const rays::SceneProbe& probe, const std::vector<Camera>& cameras);

/// Light that is to be added to a scene.
struct DefaultLight {
    bool sky = false;                    // a neutral sky
    std::vector<PunctualLight> lamps{};  // lamps at the first cameras, where the scene is closed
};

/// Returns a sky where the scene has neither a light nor an environment, or where its light is negligible for what its
/// cameras see. Returns lamps instead where there is no light and hardly any sky can enter. A scene without cameras is
/// judged by its default camera. Ignores all choices of the user, so that every camera and every frame of a scene has
/// the same light.
DefaultLight default_light(const Scene& scene);

}  // namespace halflight
