// Light trees: hierarchies over lights that choose one by its importance for a receiver.
// shaders/shared/light_tree_rows.h has the layout.
//
// The tree is built from the top by the surface area orientation heuristic (Conty Estevez and Kulla 2018, section 4.1).
// A group is split into buckets along each axis; the split with the least sum of intensity, area and angular extent
// wins. Three such splits make a node four wide. A choice among four covers two levels of a binary tree at once. This
// lowers the noise with as many bounds and half the dependent fetches.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/math.h"
#include "shaders/shared/light_tree_rows.h"

namespace halflight {

/// Bounds of lights: positions, directions and intensity.
struct LightBounds {
    dvec3 lower{0}, upper{0};  // corners of the box, relative to TraceTables::origin
    dvec3 axis{0, 0, 1};       // unit axis of emission
    double theta_o = 0;        // radians, [0, pi]: bound of the angle between axis and light normals
    double theta_e = kPi / 2;  // radians, [0, pi/2]: bound of the emission angle around a normal
    double intensity = 0;      // cd, > 0: sum of the lights' greatest luminous intensities
    bool two_sided = false;    // lights also emit along the reversed normals
    bool sized = false;        // some light has a radius
};

/// Returns the bounds of both. The cone of two opposite directions holds all directions between them.
LightBounds united(const LightBounds& a, const LightBounds& b);

/// Returns whether two lights act as one for any receiver, like the triangles of a square.
bool act_as_one(const LightBounds& a, const LightBounds& b);

struct LightTree {
    std::vector<uvec4> rows;            // kUnitLightTree; of the header only `names` is set
    std::vector<std::uint32_t> trails;  // trail of each light
};

/// Returns the tree. `names` are the indices by which leaves refer to the lights, below 2^27. Precondition: as many
/// names as lights, from 1 to 2^26. Equal inputs give equal trees.
LightTree build_light_tree(std::span<const LightBounds> lights, std::span<const std::uint32_t> names);

/// A child of a node, decoded like in the shaders.
struct LightTreeChild {
    shared::LightNode bounds;
    bool leaf;
    std::uint32_t index;  // name of the light, or index of the node
    std::uint32_t other;  // second light of a leaf that holds a pair; otherwise equal to `index`
    bool sized;           // an inner node with lights that have a radius
};
/// Returns the children of a node with the bounding ball `ball` (centre, radius); the root's is light_tree_ball().
std::vector<LightTreeChild> light_tree_children(std::span<const uvec4> rows, std::uint32_t node, const vec4& ball);
vec4 light_tree_ball(std::span<const uvec4> rows);

shared::LightTreeHeader light_tree_header(std::span<const uvec4> rows);
void set_light_tree_header(std::span<uvec4> rows, const shared::LightTreeHeader& header);

}  // namespace halflight
