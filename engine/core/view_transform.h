// The view transform of display images.
#pragma once

#include <string>

#include "engine/core/lens.h"

namespace halflight {

/// Exposure of a display image: fixed, or found by metering (renderer/metering.h).
struct Exposure {
    Exposure() = default;
    Exposure(float fixed) : stops(fixed), automatic(false) {}  // NOLINT: a number is a fixed exposure
    float stops = 0;                                           // radiance is first multiplied by 2^stops
    bool automatic = true;  // metering replaces it by a fixed exposure; until then `stops` applies
    bool operator==(const Exposure&) const = default;
};

struct ExposureTime {
    float seconds = 0;
    bool operator==(const ExposureTime&) const = default;
};

/// Settings of a camera that decide exposure and depth of field. Members that are 0 have the usual value if another one
/// is set.
struct PhysicalCamera {
    static constexpr double kUsualIso = 100, kUsualSeconds = 1.0 / 125, kUsualFstop = 16;

    float iso = 0;                 // sensitivity
    ExposureTime shutter_speed{};  // exposure time
    Lens lens{};                   // lens, with its f-number

    /// Returns whether the exposure is that of the camera. An f-number beside a focus only sets the depth of field.
    bool exposes() const { return iso > 0 || shutter_speed.seconds > 0 || (lens.fstop > 0 && !lens.focus.chosen()); }
    /// Returns the exposure in stops: -log2(1.2 x 2^EV100) with EV100 = log2(fstop^2 / shutter_speed x 100 / iso). A
    /// luminance of 1.2 x 2^EV100 nits saturates the sensor (ISO 12232) and becomes a radiance of 1 (Lagarde, de
    /// Rousiers 2014, Moving Frostbite to Physically Based Rendering, section 5.1).
    float stops() const;
    bool operator==(const PhysicalCamera&) const = default;
};

/// A requested view transform. Names are those of the config, case-insensitive; a display's trailing " - Display" may
/// be omitted.
struct ViewTransform {
    std::string display;  // name of the display; empty: the config's default
    std::string view;     // name of the view; empty: the display's default
    std::string look;     // looks; empty: the view's own; otherwise replaces them ("a, -b": a, then the inverse of b)
    Exposure exposure{};
    PhysicalCamera camera{};  // if it sets the exposure, `exposure` corrects that one and is not metered

    /// Returns whether the exposure is to be found by metering.
    bool metered() const { return exposure.automatic && !camera.exposes(); }
    /// Returns the whole exposure, stops.
    float stops() const { return camera.exposes() ? camera.stops() + exposure.stops : exposure.stops; }
    bool operator==(const ViewTransform&) const = default;
};

}  // namespace halflight
