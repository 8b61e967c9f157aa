// By which techniques light is estimated. They differ in noise and time, never in what the picture tends to.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "engine/scene/lights.h"

namespace halflight {

/// Path reuse across pixels (passes/reuse.h). Off unless asked for: it makes diffuse indirect light several times less
/// noisy for 1.3 to 2.4 times as much time a sample, which pays where that light makes the noise (scenes/room.glb), and
/// not where emitters' edges or metal do.
enum class Reuse : std::uint8_t { off, on };
inline constexpr Reuse kReuses[] = {Reuse::off, Reuse::on};
const char* name(Reuse reuse);  ///< "off", "on"

struct Estimator {
    LightChoice lights = LightChoice::automatic;  // how next-event estimation picks a light
    Reuse reuse = Reuse::off;                     // where it is left out, `on` stays without effect
    bool operator==(const Estimator&) const = default;
};

/// "key=value" for each technique, joined by commas.
std::string text(const Estimator& estimator);
/// Of such a list; what it does not name stays as it is by default. Throws Error, with the list as its subject, where a
/// key or a value is none, or a key is given twice.
Estimator estimator_named(std::string_view list);
/// "lights=auto|power|tree|uniform,reuse=off|on", for helps.
std::string known_estimators();

}  // namespace halflight
