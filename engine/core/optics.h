// The map from directions to the picture, and the places of two eyes.
#pragma once

#include <span>
#include <string>

#include "engine/core/math.h"

namespace halflight {

/// Map from directions to the picture. Only that of the camera itself can be rasterized.
enum class Projection : std::uint8_t {
    camera,     // perspective or orthographic, as the camera is
    panorama,   // equirectangular: longitude across, latitude down, 360 x 180 degrees
    fisheye,    // equidistant: the angle from the axis is in proportion to the distance from the centre
    equisolid,  // equal areas of the picture have equal solid angles
};
std::span<const Projection> projections();
const char* name(Projection projection);  ///< Returns "auto", "panorama", "fisheye" or "fisheye-equisolid".

/// Eyes that the picture shows.
enum class Stereo : std::uint8_t {
    none,          // the camera itself
    left,          // the left eye
    right,         // the right eye
    over_under,    // the left eye in the upper half of the picture, the right one in the lower half
    side_by_side,  // the left eye in the left half of the picture, the right one in the right half
    views,         // like over_under; an .exr has both eyes as views of the same pixels
};
std::span<const Stereo> stereo_layouts();
const char* name(Stereo stereo);

struct Optics {
    Projection projection = Projection::camera;
    double fisheye_fov = 180;  // angle across the image circle of a fisheye, degrees, (0, 360]
    Stereo stereo = Stereo::none;
    double eye_distance = 0.065;  // distance between the eyes, world units, > 0
    // Distance at which the lines of sight of both eyes meet, world units; 0: they are parallel.
    double convergence = 0;

    /// Returns whether a rasterizer cannot draw the picture.
    bool traced() const { return projection != Projection::camera || stereo != Stereo::none; }
    bool is_fisheye() const { return projection == Projection::fisheye || projection == Projection::equisolid; }
    bool operator==(const Optics&) const = default;
};

/// Returns the number of eyes side by side and one above the other in the picture.
dvec2 eyes_in_picture(const Optics& optics);
/// Returns "height" or "width" if a side of the picture cannot be halved between both eyes, "" for a size that fits.
const char* odd_side(const Optics& optics, const ivec2& image);
/// Returns width / height of the picture of one eye. image: size of the whole picture, pixels.
double eye_aspect(const Optics& optics, const ivec2& image);
/// Returns "panorama, stereo over-under, eyes 0.065 m apart"; empty for what the camera itself shows.
std::string text(const Optics& optics);

}  // namespace halflight
