// The pixels that surfaces cover, to tell the outline of an object from edges inside it. Uses no window.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tools/view/projection.h"

namespace halflight::view {

class Coverage {
  public:
    explicit Coverage(const ivec2& size);
    /// Adds a triangle in camera space, as far as it is in front of the camera.
    void add(const Projection& projection, const dvec3& a, const dvec3& b, const dvec3& c);
    /// Returns the parts of a line that have covered pixels on one side at most.
    void add_outer_parts(const PictureLine& line, std::vector<PictureLine>& lines) const;

  private:
    void fill(std::span<const dvec2> corners);
    bool covers(const dvec2& point) const;

    ivec2 size_;
    std::vector<std::uint8_t> pixels_;  // row by row; 1: covered
};

}  // namespace halflight::view
