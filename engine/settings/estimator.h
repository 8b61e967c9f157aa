// Sampling techniques of the light estimator. They differ in noise and time, never in the limit of the picture.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "engine/scene/scene.h"
#include "engine/tables/lights.h"

namespace halflight {

/// Path reuse across pixels (passes/light/reuse.h), by the number of pixels of a group. Groups of 16 reduce the noise
/// of diffuse indirect light several times for 1.3 to 2.4 times the time of a sample. This pays where that light
/// dominates the noise (scenes/room.glb), and not where edges of emitters or metal do. Smaller groups cost less. They
/// are as good where the pixels of a large group see too different surfaces to reach each other's points
/// (scenes/atrium.glb).
enum class Reuse : std::uint8_t { automatic, off = 1, four = 4, eight = 8, sixteen = 16 };
inline constexpr Reuse kReuses[] = {Reuse::automatic, Reuse::off, Reuse::four, Reuse::eight, Reuse::sixteen};
const char* name(Reuse reuse);  ///< Returns "auto", "off", "4", "8" or "16".

/// Sample points. Blue noise suits pictures of few samples: errors of neighbours cancel, so that the picture looks less
/// noisy from a distance. The error of a pixel is unchanged. Pictures of more than kMostBlueNoiseSamples samples, or of
/// an unknown number, use `sobol` instead. Independent points serve for comparison: they converge with the exact rate
/// of Monte Carlo, variance in inverse proportion to samples.
enum class SamplePoints : std::uint8_t { sobol, blue_noise, independent };
inline constexpr SamplePoints kSamplePoints[] = {SamplePoints::sobol, SamplePoints::blue_noise,
                                                 SamplePoints::independent};
/// Returns "sobol" (Owen-scrambled, shaders/shared/sobol.h), "blue-noise" or "independent".
const char* name(SamplePoints points);
inline constexpr int kMostBlueNoiseSamples = 64;

/// Camera rays of each sample for directly visible light, above all at edges of emitters. The first one is that of the
/// path; further ones cost less than a path. Four rays halve the squared error times time where edges of emitters are
/// visible (scenes/cornell.glb). Elsewhere they cost up to a third more time without benefit.
enum class CameraRays : std::uint8_t { automatic, one = 1, two = 2, four = 4, eight = 8, sixteen = 16 };
inline constexpr CameraRays kCameraRays[] = {CameraRays::automatic, CameraRays::one,   CameraRays::two,
                                             CameraRays::four,      CameraRays::eight, CameraRays::sixteen};
const char* name(CameraRays rays);  ///< Returns "auto", "1", "2", "4", "8" or "16".

/// Shadow rays of each path from its first surface, not counting the ray to a separately sampled sun. They cost less
/// than paths, and pay where direct light is as noisy as the rest (scenes/room.glb with path reuse).
enum class ShadowRays : std::uint8_t { automatic, one = 1, two = 2, four = 4, eight = 8 };
inline constexpr ShadowRays kShadowRays[] = {ShadowRays::automatic, ShadowRays::one, ShadowRays::two, ShadowRays::four,
                                             ShadowRays::eight};
const char* name(ShadowRays rays);  ///< Returns "auto", "1", "2", "4" or "8".

/// The techniques of a picture. A pilot settles `automatic` for reuse, camera and shadow (renderer/pilot.h).
struct Estimator {
    LightChoice lights = LightChoice::automatic;  // choice of a light by next-event estimation
    SunChoice sun = SunChoice::apart;             // sampling of the sun; no effect without it or without other lights
    Reuse reuse = Reuse::off;                     // size of path reuse groups; no effect if path reuse is left out
    CameraRays camera = CameraRays::one;
    ShadowRays shadow = ShadowRays::one;
    SamplePoints sampler = SamplePoints::sobol;
    bool operator==(const Estimator&) const = default;
};

/// Returns whether a pilot must settle some technique.
bool leaves_open(const Estimator& estimator);

/// Returns "key=value" for each technique, joined by commas.
std::string text(const Estimator& estimator);
/// Returns text() of only those techniques that differ from the default or from one of the others.
std::string difference(const Estimator& estimator, std::span<const Estimator> others);
/// Parses a list like that of text(); techniques that it does not name keep their default. "auto" as its first word
/// leaves all possible choices to a pilot. Throws Error, with the list as its subject, for unknown keys or values and
/// for repeated keys.
Estimator estimator_named(std::string_view list);
/// Returns "auto,lights=auto|power|tree|uniform,sun=apart|among,..." for help texts.
std::string known_estimators();

}  // namespace halflight
