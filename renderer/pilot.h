// How many camera rays, shadow rays and pixels of a group a scene's pictures should take, where that is left open
// (`automatic`): found from a few small pictures before the first one.
#pragma once

#include "engine/color/color.h"
#include "engine/device/prepared_scene.h"
#include "engine/settings/estimator.h"
#include "renderer/render.h"

namespace halflight {

/// Mean squared errors over pixels and channels, by what can lower them: camera rays, shadow rays, path reuse.
struct PilotErrors {
    double emission = 0;  // seen directly
    double direct = 0;
    double indirect = 0;
};
struct PilotFigures {
    PilotErrors plain;  // with as little as possible of what is left open
    PilotErrors tried;  // with kTried of it
};
inline constexpr Estimator kTried{.reuse = Reuse::sixteen, .camera = CameraRays::four, .shadow = ShadowRays::four};

/// Of what `asked` leaves open, the choice with the least squared error times cost. Errors of other numbers of rays and
/// pixels are interpolated: emitters' edges by a power law, since points are well distributed in a pixel; the others as
/// what n samples share and 1/n of what they do not. Costs are those of pictures of scenes/, the same everywhere, so
/// that a choice does not depend on how busy a machine is. What is hardly better than something cheaper is not chosen.
Estimator settled(const Estimator& asked, const PilotFigures& figures);

/// Settles what the scene's estimator leaves open, if anything, by small pictures through the settings' camera:
/// kPilotPictures independent ones of kPilotSamples samples each, plain and with kTried, and kPilotEmissionPictures of
/// emission alone. They share no sample with what is rendered later, so that nothing is biased. From then on it is the
/// scene's, whatever the camera and the pose. Takes as long as two to four samples of a large picture, which counts as
/// preparation. Being smaller than the picture, they show members of a group farther apart than they are in it: of
/// large pictures, path reuse is underrated.
void settle_estimator(PreparedScene& scene, const ColorConfig& colors, const RenderSettings& settings);
inline constexpr double kPilotPixels = 96 * 64;  // about, of a picture
inline constexpr double kPilotShare = 1.0 / 16;  // of the settings' pixels, where that is more
inline constexpr int kPilotPictures = 4;
inline constexpr int kPilotEmissionPictures = 8;
inline constexpr int kPilotSamples = 4;

}  // namespace halflight
