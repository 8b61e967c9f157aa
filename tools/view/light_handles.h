// Handles of the selected light beside those that move it: its direction, the cone of a spot, the size of a surface.
// Uses no window.
#pragma once

#include <optional>
#include <vector>

#include "tools/view/session.h"

namespace halflight::view {

/// Property of a light that a handle changes.
enum class LightHandle { aim, inner, outer, width, height };

/// Place and shape of the selected light when a drag begins.
struct LightShape {
    dvec3 place;      // world units; of a sun the point about which the camera turns
    dvec3 direction;  // unit, towards where the light shines; of a sun towards the sun
    dvec3 across;     // unit, at right angles to `direction`, and to the view unless it looks along the light
    double reach;     // length of handles at this place, world units
    bool sun = false, spot = false, aims = false, end_on = false;  // end_on: the view looks along the light
    double inner = 0, outer = 0;                                   // degrees, of a spot
    std::optional<AreaLamp> area{};
};
/// Returns the shape of the selected light; none if no light is selected, or if it is behind the camera. length: that
/// of handles, pixels.
std::optional<LightShape> selected_light(const Session& session, const ivec2& size, double length);

/// Lines of a handle, pixels. Each ends with the square that is dragged.
struct LightGrip {
    LightHandle handle;
    std::vector<PictureLine> lines;
};
std::vector<LightGrip> light_grips(const LightShape& light, const Camera& camera, const ivec2& size, double length);

/// Changes the edit of a light as a drag from pixel to pixel does. `light` is its shape when the drag began.
void drag_light(const LightShape& light, LightHandle handle, const Camera& camera, const ivec2& size, const dvec2& from,
                const dvec2& to, LightEdit& edit);

/// Adds a square about a pixel.
void add_square(const dvec2& middle, double half, std::vector<PictureLine>& lines);
/// Returns the points of a circle about `centre` with the perpendicular radii `u` and `v`; the last one is the first.
std::vector<dvec3> circle(const dvec3& centre, const dvec3& u, const dvec3& v);

inline constexpr int kRingSteps = 64;    ///< lines of a ring
inline constexpr double kKnob = 0.05;    ///< half size of a square that changes a light, lengths of handles
inline constexpr double kEdgeOn = 0.08;  ///< cosine of the angle below which a ring counts as seen from the side

}  // namespace halflight::view
