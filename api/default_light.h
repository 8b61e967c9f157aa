// The decision whether a scene gets a neutral sky or lamps: what its own light, and what a sky, would show to its
// cameras.
#pragma once

#include <vector>

#include "engine/rays/scene_probe.h"
#include "engine/scene/scene.h"

namespace halflight {

/// Shares of the surface points that cameras see, [0,1], points that emit light themselves left out.
struct LightShares {
    double lit = 0;      // the scene's own light is not negligible
    double sky_lit = 0;  // it gives less, and a sky of radiance 1 would give at least kNegligibleLight
};

/// Irradiance over pi below which a surface counts as dark: a hundredth of what a whole sky of radiance 1 gives. Where
/// a camera sees surfaces that emit, such as labels or screens, they keep the exposure low, so more is dark.
inline constexpr double kNegligibleLight = 0.01, kNegligibleBesideEmission = 0.05;
/// Limit that replaces kNegligibleBesideEmission where all light comes from emissive textures of at most 1. Labels,
/// screens and glow maps without KHR_materials_emissive_strength are meant to look white, not to light a scene.
inline constexpr double kNegligibleBesideDisplays = 0.2;
/// A neutral sky is added where a smaller share is lit, and the sky would light a share of at least kSkyShare.
inline constexpr double kLitShare = 0.1;
inline constexpr double kSkyShare = 0.25;
/// Share that a sky must light in a scene without any light; else it cannot enter, and cameras get lamps.
inline constexpr double kLeastSkyShare = 0.01;

/// Estimates the shares by paths on the CPU, a fixed number for each scene. Directional lights, points, spots, emissive
/// triangles and their textures count; surfaces reflect half of the light.
LightShares light_shares(const Scene& scene, const rays::SceneProbe& probe, const std::vector<Camera>& cameras);

/// Light that is to be added to a scene.
struct DefaultLight {
    bool sky = false;                    // a neutral sky
    std::vector<PunctualLight> lamps{};  // lamps at the first cameras, where the scene is closed
};

/// Returns a sky where the scene has neither a light nor an environment, or where its light is negligible for what its
/// cameras see. Returns lamps instead where there is no light and no sky can enter. A scene without cameras is judged
/// by its default camera. Ignores all choices of the user, so that every camera and every frame of a scene has the same
/// light.
DefaultLight default_light(const Scene& scene);

}  // namespace halflight
