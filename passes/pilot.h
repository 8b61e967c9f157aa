// How many camera rays, shadow rays and pixels of a group a scene's pictures should take, where that is left open
// (`automatic`): found from a few small pictures before the first one.
#pragma once

#include "engine/color/color.h"
#include "passes/estimator.h"
#include "passes/prepared_scene.h"
#include "passes/render.h"

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

/// Settles what the scene's estimator leaves open, if anything, by pictures through the settings' camera: of about
/// kPilotPixels pixels, kPilotPictures independent ones of kPilotSamples samples each, plain and with kTried. They
/// share no sample with those of any seed, so that nothing is biased. From then on it is the scene's, whatever the
/// camera and the pose. Takes as long as a few samples of a larger picture, which counts as preparation.
void settle_estimator(PreparedScene& scene, const ColorConfig& colors, const RenderSettings& settings);
inline constexpr int kPilotPixels = 96 * 64;
inline constexpr int kPilotPictures = 4;
inline constexpr int kPilotSamples = 4;

}  // namespace halflight
