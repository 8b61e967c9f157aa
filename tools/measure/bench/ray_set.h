// The rays that tracers are measured with: what the passes of a frame ask for.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/rays/rays.h"
#include "shaders/shared/rays.h"

namespace halflight::bench {

struct RaySet {
    std::string kind;  // of ray_kinds()
    rays::RayKind ray_kind = rays::RayKind::primary;
    bool any_hit = false;
    bool coherent = false;                // hint to Embree's single-ray mode
    std::vector<shared::Ray> rays;        // by path; a multiple of 256
    bool listed = false;                  // only `order` is to be traced; else all paths, in their order
    std::vector<std::uint32_t> order;     // paths to be traced, in the order in which the pass has them
    std::vector<std::uint32_t> scanline;  // the same, along the picture's rows; where paths are not pixels: `order`
    std::size_t live = 0;                 // of `order`; the others are dead rays
    float tolerance = 0;                  // of t: 2^-20 of the scene's diagonal, all directions being of unit length
};

/// What a method says of a set, by path. One of the two is empty.
struct Answers {
    std::vector<shared::Hit> hits;
    std::vector<std::uint32_t> occluded;  // kFree, kOccluded, kUnfinished
};

/// Names in the order of reports:
///   primary     the G-buffer's camera rays
///   hard        shadow rays to the scene's first directional light, else its first punctual one, else to a point above
///               the camera
///   soft        shadow rays to the scene's emissive triangles alone, else to a square of 1/20 of its diagonal there
///   glossy      first bounce, all materials being metal of roughness 0.2
///   diffuse     first bounce, all materials being purely diffuse
///   ao          the same, 1/20 of the scene's diagonal long: any hit
///   connection  from the 16 pixels of an interleaved group to what one of their diffuse rays has hit: any hit. 16
///               consecutive rays go to the same point; 256 are one group
///   bounce2     second bounce of the scene as it is
///   mixed       shadow rays of the scene as it is, with all its lights
const std::vector<std::string>& ray_kinds();

}  // namespace halflight::bench
