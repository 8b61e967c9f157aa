// By which techniques light is estimated. They differ in noise and time, never in what the picture tends to.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "engine/scene/lights.h"

namespace halflight {

/// Path reuse across pixels (passes/reuse.h).
enum class Reuse : std::uint8_t { automatic, on, off };
inline constexpr Reuse kReuses[] = {Reuse::automatic, Reuse::on, Reuse::off};
const char* name(Reuse reuse);  ///< "auto", "on", "off"
/// What `automatic` comes to: `on` unless more than kMostGlossyShare of the scene's area is metal or transmits. Light
/// that leaves a path's second vertex glossily is not for others, and where it makes the noise, sharing the rest costs
/// more than it saves: of scenes/, those with 3 % and 20 % of such area lose, those with up to 0.2 % gain.
Reuse choose_reuse(Reuse asked, const Scene& scene);
inline constexpr double kMostGlossyShare = 0.01;  // engine/scene/reflectance.h

struct Estimator {
    LightChoice lights = LightChoice::automatic;  // how next-event estimation picks a light
    Reuse reuse = Reuse::automatic;               // where it is left out, `on` stays without effect
    bool operator==(const Estimator&) const = default;
};

/// "key=value" for each technique, joined by commas.
std::string text(const Estimator& estimator);
/// Of such a list; what it does not name stays as it is by default. Throws Error, with the list as its subject, where a
/// key or a value is none, or a key is given twice.
Estimator estimator_named(std::string_view list);
/// "lights=auto|power|tree|uniform,reuse=auto|on|off", for helps.
std::string known_estimators();

}  // namespace halflight
