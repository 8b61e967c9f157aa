// Hierarchies over lights for choice by importance (shaders/shared/light_tree.h has the layout).
//
// Built from the top by the surface area orientation heuristic (Conty Estevez and Kulla 2018, section 4.1): of the
// splits of a group into buckets along each axis, the one with the least sum of intensity, area and angular extent.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/math.h"
#include "shaders/shared/light_tree.h"

namespace halflight {

/// Where lights are, where they shine, and how brightly.
struct LightBounds {
    dvec3 lower{0}, upper{0};  // relative to TraceTables::origin
    dvec3 axis{0, 0, 1};       // unit
    double theta_o = 0;        // radians, [0, pi]: how far from the axis their own directions are
    double theta_e = kPi / 2;  // radians, [0, pi/2]: how far from these they shine
    double intensity = 0;      // > 0, cd: the sum of each one's greatest, of luminance
    bool two_sided = false;    // and along the reversed directions, too
};

/// Bounds of both. Opposite directions make a cone of all directions between them, not one of those that cancel out.
LightBounds united(const LightBounds& a, const LightBounds& b);

struct LightTree {
    std::vector<vec4> rows;             // UNIT_LIGHT_TREE; the header is left to who decides how often it is asked
    std::vector<std::uint32_t> trails;  // of each light
};

/// names: what leaves call the lights, below 2^27. Precondition: as many names as lights, two at least, at most 2^26.
/// Equal inputs give equal trees.
LightTree build_light_tree(std::span<const LightBounds> lights, std::span<const std::uint32_t> names);

/// A node as the shaders read it; `which`: 0 or 1 of the pair.
shared::LightNode light_node(std::span<const vec4> rows, std::uint32_t pair, int which);
/// Its word: leaf, two-sided, index.
std::uint32_t light_node_word(std::span<const vec4> rows, std::uint32_t pair, int which);

}  // namespace halflight
