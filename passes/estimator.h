// By which techniques light is estimated. They differ in noise and time, never in what the picture tends to.
#pragma once

#include <string>
#include <string_view>

#include "engine/scene/lights.h"

namespace halflight {

struct Estimator {
    LightChoice lights = LightChoice::automatic;  // how next-event estimation picks a light
    bool operator==(const Estimator&) const = default;
};

/// "key=value" for each technique, joined by commas.
std::string text(const Estimator& estimator);
/// Of such a list; what it does not name stays as it is by default. Throws Error, with the list as its subject, where a
/// key or a value is none, or a key is given twice.
Estimator estimator_named(std::string_view list);
/// "lights=auto|power|tree|uniform", for helps.
std::string known_estimators();

}  // namespace halflight
