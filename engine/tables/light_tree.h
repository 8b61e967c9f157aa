// Hierarchies over lights for choice by importance (shaders/shared/light_tree.h has the layout).
//
// Built from the top by the surface area orientation heuristic (Conty Estevez and Kulla 2018, section 4.1): of the
// splits of a group into buckets along each axis, the one with the least sum of intensity, area and angular extent.
// Nodes are four wide, by three such splits: a choice of four at once sees what lies below two steps of a binary tree,
// so that its noise is lower, for as many bounds and half as many rows, one after the other, to wait for.
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
    std::vector<uvec4> rows;            // UNIT_LIGHT_TREE; of the header only `names`
    std::vector<std::uint32_t> trails;  // of each light
};

/// names: what leaves call the lights, below 2^27. Precondition: as many names as lights, two at least, at most 2^26.
/// Equal inputs give equal trees.
LightTree build_light_tree(std::span<const LightBounds> lights, std::span<const std::uint32_t> names);

/// A child of a node, as the shaders read it.
struct LightTreeChild {
    shared::LightNode bounds;
    bool leaf;
    std::uint32_t index;  // of the light, by its name, or of the node
    std::uint32_t other;  // the second light of a leaf that is a pair; else the same one
};
/// The children of a node, whose ball (centre, radius) is given: that of the root is light_tree_ball().
std::vector<LightTreeChild> light_tree_children(std::span<const uvec4> rows, std::uint32_t node, const vec4& ball);
vec4 light_tree_ball(std::span<const uvec4> rows);

shared::LightTreeHeader light_tree_header(std::span<const uvec4> rows);
void set_light_tree_header(std::span<uvec4> rows, const shared::LightTreeHeader& header);

}  // namespace halflight
