// By which techniques light is estimated. They differ in noise and time, never in what the picture tends to.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "engine/scene/scene.h"
#include "engine/tables/lights.h"

namespace halflight {

/// Path reuse across pixels (passes/light/reuse.h). Off unless asked for: groups of 16 make diffuse indirect light
/// several times less noisy for 1.3 to 2.4 times as much time a sample, which pays where that light makes the noise
/// (scenes/room.glb), and not where emitters' edges or metal do. Smaller groups cost less, and are as good where the
/// members of large ones see too different surfaces to find each other's points (scenes/atrium.glb).
enum class Reuse : std::uint8_t { automatic, off = 1, four = 4, eight = 8, sixteen = 16 };  // pixels of a group
inline constexpr Reuse kReuses[] = {Reuse::automatic, Reuse::off, Reuse::four, Reuse::eight, Reuse::sixteen};
const char* name(Reuse reuse);  ///< "auto", "off", "4", "8", "16"

/// Where samples lie. Blue noise is for pictures of few samples, which look less noisy from afar: pixels are no better,
/// but errors of neighbours cancel; a picture of more than kMostBlueNoiseSamples, or of any number that is not known
/// before, has the points of `sobol` instead. Independent points converge with the exact rate of Monte Carlo, variance
/// in inverse proportion to samples, which is what they are for: to compare with.
enum class SamplePoints : std::uint8_t { sobol, blue_noise, independent };
inline constexpr SamplePoints kSamplePoints[] = {SamplePoints::sobol, SamplePoints::blue_noise,
                                                 SamplePoints::independent};
/// "sobol": Owen-scrambled (shaders/shared/sobol.h), "blue-noise", "independent"
const char* name(SamplePoints points);
inline constexpr int kMostBlueNoiseSamples = 64;

/// Camera rays of each sample for light that is seen directly, emitters' edges above all; as many samples of the rest
/// would be better, but cost a path each. One is the path's own. Four have half the squared error times time where
/// emitters' edges are in sight (scenes/cornell.glb), and take up to a third more time for nothing where none is.
enum class CameraRays : std::uint8_t { automatic, one = 1, two = 2, four = 4, eight = 8, sixteen = 16 };
inline constexpr CameraRays kCameraRays[] = {CameraRays::automatic, CameraRays::one,   CameraRays::two,
                                             CameraRays::four,      CameraRays::eight, CameraRays::sixteen};
const char* name(CameraRays rays);  ///< "auto", "1", "2", "4", "8", "16"

/// Shadow rays of each path from the surface that the camera sees, but for that to a sun that is apart. They cost less
/// than paths do, and pay where direct light is as noisy as the rest (scenes/room.glb with path reuse).
enum class ShadowRays : std::uint8_t { automatic, one = 1, two = 2, four = 4, eight = 8 };
inline constexpr ShadowRays kShadowRays[] = {ShadowRays::automatic, ShadowRays::one, ShadowRays::two, ShadowRays::four,
                                             ShadowRays::eight};
const char* name(ShadowRays rays);  ///< "auto", "1", "2", "4", "8"

struct Estimator {
    LightChoice lights = LightChoice::automatic;  // how next-event estimation picks a light
    SunChoice sun = SunChoice::apart;             // without effect where there is no sun, or nothing else
    // `automatic` is settled by a pilot (renderer/pilot.h).
    Reuse reuse = Reuse::off;  // where it is left out it stays without effect
    CameraRays camera = CameraRays::one;
    ShadowRays shadow = ShadowRays::one;
    SamplePoints sampler = SamplePoints::sobol;
    bool operator==(const Estimator&) const = default;
};

/// Whether a pilot is to settle some of it.
bool leaves_open(const Estimator& estimator);

/// "key=value" for each technique, joined by commas.
std::string text(const Estimator& estimator);
/// The same of those techniques that set it apart from the default or from one of the others.
std::string difference(const Estimator& estimator, std::span<const Estimator> others);
/// Of such a list; what it does not name stays as it is by default. "auto" as its first word leaves to a pilot what can
/// be left to one. Throws Error, with the list as its subject, where a key or a value is none, or a key is given twice.
Estimator estimator_named(std::string_view list);
/// "auto,lights=auto|power|tree|uniform,sun=apart|among,...", for helps.
std::string known_estimators();

}  // namespace halflight
