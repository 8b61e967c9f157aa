// Projection of the world to the picture, for drawings on top of it. Uses no window.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "engine/scene/scene.h"

namespace halflight::view {

/// A line of a picture, pixels from its upper left corner.
using PictureLine = std::array<dvec2, 2>;

/// Distance of the plane that clips lines and triangles, as a share of that of their farthest corner.
inline constexpr double kNear = 1e-4;

/// Projects points to the pixels of a picture that a camera sees.
class Projection {
  public:
    Projection(const Camera& camera, const ivec2& size);
    /// Returns a point of the world in camera space: the camera looks along -Z.
    dvec3 to_camera(const dvec3& world) const { return dvec3(to_camera_ * dvec4(world, 1)); }
    /// Returns the pixel of a point of the world; none behind the camera.
    std::optional<dvec2> pixel(const dvec3& world) const;
    bool perspective() const { return !orthographic_; }
    /// Returns the length of a world unit at a point of the world, pixels; none behind the camera.
    std::optional<double> pixels_per_unit(const dvec3& world) const;
    /// Returns the pixel of a point in camera space, which is in front of the camera.
    dvec2 flat(const dvec3& camera_space) const;
    /// Adds the line between two points in camera space, as far as it is in front of the camera.
    void add_line(dvec3 a, dvec3 b, std::vector<PictureLine>& lines) const;

  private:
    dmat4 to_camera_;
    bool orthographic_;
    ivec2 size_;
    double pixels_;  // pixels per unit at distance 1; with an orthographic camera at all distances
};

}  // namespace halflight::view
