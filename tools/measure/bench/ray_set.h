// Ray sets for measurements: the rays of the passes of a frame.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/rays/rays.h"
#include "shaders/shared/ray_structs.h"

namespace halflight::bench {

struct RaySet {
    std::string kind;  // member of ray_kinds()
    rays::RayKind ray_kind = rays::RayKind::primary;
    bool any_hit = false;
    bool coherent = false;                // hint to Embree's single-ray mode
    std::vector<shared::Ray> rays;        // one ray per path, with unit directions; a multiple of 256
    bool listed = false;                  // true: only the paths in `order` are traced; false: all
    std::vector<std::uint32_t> order;     // paths to trace, in the order of the pass
    std::vector<std::uint32_t> scanline;  // `order` sorted by row of the picture; unsorted if paths are not pixels
    std::size_t live = 0;                 // number of rays in `order` that are not dead
    float tolerance = 0;                  // greatest difference of t between methods: 2^-20 of the scene's diagonal
};

/// A method's answers for a set, by path. Either `hits` or `occluded` is empty.
struct Answers {
    std::vector<shared::Hit> hits;
    std::vector<std::uint32_t> occluded;  // kFree, kOccluded or kUnfinished
};

/// Returns the names in the order of reports:
///   primary     the G-buffer's camera rays
///   hard        shadow rays to the scene's first directional light, else its first punctual one, else to a point above
///               the camera
///   soft        shadow rays to the scene's emissive triangles alone, else to a square with 1/20 of its diagonal above
///   glossy      first bounce, all materials being metal of roughness 0.2
///   diffuse     first bounce, all materials being purely diffuse
///   ao          diffuse rays cut at 1/20 of the scene's diagonal: any hit
///   connection  from the 16 pixels of an interleaved group to the hit of one of their diffuse rays: any hit. 16
///               consecutive rays go to the same point; 256 are one group
///   bounce2     second bounce of the scene as it is
///   mixed       shadow rays of the scene as it is, with all its lights
const std::vector<std::string>& ray_kinds();

/// Returns the member `name` of each element.
template <class List>
std::vector<std::string> names_of(const List& list) {
    std::vector<std::string> names;
    for (const auto& element : list) names.emplace_back(element.name);
    return names;
}

}  // namespace halflight::bench
