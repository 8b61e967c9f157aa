// The pilot: a few small pictures of a scene, made before the first picture, which settle automatic numbers of camera
// rays, shadow rays and pixels of a group.
#pragma once

#include <functional>

#include "engine/color/color.h"
#include "engine/device/prepared_scene.h"
#include "engine/settings/estimator.h"
#include "renderer/render.h"

namespace halflight {

/// Mean squared errors over pixels and channels, split by remedy: camera rays, shadow rays, path reuse.
struct PilotErrors {
    double emission = 0;  // error of directly visible light
    double direct = 0;
    double indirect = 0;
};
struct PilotFigures {
    PilotErrors plain;  // errors with the smallest value of each open choice
    PilotErrors tried;  // errors with the values of kTried
};
inline constexpr Estimator kTried{.reuse = Reuse::sixteen, .camera = CameraRays::four, .shadow = ShadowRays::four};

/// Returns `asked` with the open choices that minimize squared error times cost. Errors of other numbers of rays and
/// pixels are interpolated. Errors at emitters' edges follow a power law, since points are well distributed in a pixel.
/// The other errors consist of a part that n samples share and 1/n of the rest. Costs are constants, measured with
/// pictures of scenes/, so that a choice does not depend on the load of the machine. A choice that is hardly better
/// than a cheaper one is not taken.
Estimator settled(const Estimator& asked, const PilotFigures& figures);

/// Receives the share of a pilot's work that is done, [0,1]; returns false to cancel.
using PilotProgress = std::function<bool(double share)>;

/// Settles what the scene's estimator leaves open, if anything, by small pictures through the settings' camera. There
/// are kPilotPictures independent pictures of kPilotSamples samples, plain and with kTried, and kPilotEmissionPictures
/// of emission alone. They share no sample with later pictures, so that nothing is biased. The result holds for all
/// later cameras and poses of the scene. It takes as long as two to four samples of a large picture, which counts as
/// preparation. The small pictures show members of a group farther apart than the large one does: for large pictures,
/// path reuse is underrated. In a picture that is denoised, errors of reflected light count kDenoisedError times, since
/// emission is not filtered. Returns false if `progress` has cancelled; the estimator then stays open. Throws Error
/// as Renderer does.
bool find_estimator(PreparedScene& scene, const ColorConfig& colors, const RenderSettings& settings,
                    const PilotProgress& progress = {});
inline constexpr double kPilotPixels = 96 * 64;  // approximate number of pixels of a picture
inline constexpr double kPilotShare = 1.0 / 16;  // minimum share of the settings' pixels
inline constexpr int kPilotPictures = 4;
inline constexpr int kPilotEmissionPictures = 8;
inline constexpr int kPilotSamples = 4;
inline constexpr double kDenoisedError = 1.0 / 8;  // squared error that the denoiser leaves of 16 samples, at most

}  // namespace halflight
