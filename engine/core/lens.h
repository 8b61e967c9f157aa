// The lens of a camera: what is in focus, and how much everything else is blurred.
#pragma once

#include <cstdint>

#include "engine/core/math.h"

namespace halflight {

struct Focus {
    enum class Kind : std::uint8_t {
        open,      // nothing is chosen: everything is sharp, or settings leave the choice to the scene's camera
        none,      // everything is sharp
        distance,  // the plane at `distance` is sharp
        point,     // the surface that is seen at `point` is sharp
    };
    Kind kind = Kind::open;
    double distance = 0;  // distance along the line of sight, world units, > 0, +inf allowed
    dvec2 point{0.5};     // shares of the picture's width and height, from its upper left corner, [0,1]

    /// Returns whether a plane is in focus.
    bool chosen() const { return kind == Kind::distance || kind == Kind::point; }
    bool operator==(const Focus&) const = default;
};

/// A thin lens with a diaphragm. Members that are 0 are not set.
struct Lens {
    static constexpr double kUsualSensor = 36;  // mm, full frame

    float fstop = 0;      // f-number: focal length / diameter of the aperture, > 0
    double aperture = 0;  // diameter of the aperture, mm, > 0; replaces that of the f-number
    double sensor = 0;    // length of the sensor along the picture's longer side, mm; usual kUsualSensor
    Focus focus{};
    int blades = 0;       // number of blades, >= 3; 0: the aperture is round
    double rotation = 0;  // turn of the blades, degrees, counterclockwise as seen from behind the camera

    /// Returns whether some distances are blurred.
    bool blurs() const { return focus.chosen() && (fstop > 0 || aperture > 0); }
    bool operator==(const Lens&) const = default;
};

}  // namespace halflight
