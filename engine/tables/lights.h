// Tables of lights (layouts: shaders/shared/{light,environment}.h) and the probabilities of choosing them.
//
// A light is chosen by its share of the radiant power, in nit m^2 sr of luminance:
//   emissive triangle  2 pi A L
//   point              4 pi I
//   spot               I times the solid angle of its cone
//   with a profile     I times the integral of the profile over all directions
//   directional        E pi R^2, R: radius of the scene
//   environment        pi R^2 int L dw
// The last two grow with the scene, although they may light only one room of it. So a quarter of the choices goes in
// equal parts to the kinds that are present (triangles, points and spots, directional, environment). A dim light may be
// the only one in its room. So an eighth goes in equal parts to all lights.
//
// Few lights are not chosen beforehand: a vertex samples all of them, and keeps one of the samples (next_event.glsl).
// Each light then has the probability 1. A single square is chosen by power, because sampling both of its triangles
// brings nothing.
//
// With more lights, triangles, points and spots have a light tree (light_tree.h). The tree gets their share and that of
// the environment, without that eighth. Shaders distribute it anew for each receiver, first between the environment and
// the tree. The two triangles of a square count as one light here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/core/image.h"
#include "engine/tables/tables.h"

namespace halflight {

enum class LightChoice : std::uint8_t {
    automatic,  // all if there are few lights, otherwise tree; power if there is nothing to choose from
    power,
    tree,     // power if no light fits into a tree, or one that is alone
    uniform,  // equal probabilities, as a baseline for comparisons
    all,      // every light is sampled, and one of the samples is kept; tree if there are too many lights
};
inline constexpr std::size_t kFewLights = 8;         ///< largest number of lights of which `automatic` samples all
inline constexpr std::size_t kMostLightsOfAll = 64;  ///< largest number of lights of which `all` samples all
inline constexpr LightChoice kLightChoices[] = {LightChoice::automatic, LightChoice::power, LightChoice::tree,
                                                LightChoice::uniform, LightChoice::all};
const char* name(LightChoice choice);  ///< Returns "auto", "power", "tree", "uniform" or "all".

struct LightTables {
    // kUnitLights: triangles, punctual lights, the environment, the separate sun; then the profiles
    std::vector<vec4> rows;
    std::vector<vec2> alias;  // kUnitLightAlias: alias table over lights
    // kUnitLightOfTriangle: light by triangle. Paged scenes: emissive triangles by light, ascending. Empty if none
    // emits.
    std::vector<std::uint32_t> light_of_triangle;
    // kUnitLightGroups: groups and links of the environment, of emission that is no light, and of each light. Empty
    // without groups and links
    std::vector<std::uint32_t> groups;
    std::vector<uvec4> links;                 // kUnitLightLinks; empty without links
    Image environment;                        // kUnitEnvironment: map times its colour; empty if black
    std::vector<vec4> environment_warp;       // kUnitEnvironmentWarp: hierarchy of cells
    std::vector<uvec4> tree;                  // kUnitLightTree: light tree; empty without one
    LightChoice choice = LightChoice::power;  // the choice in use, never `automatic`
    double tree_share = 0;                    // share of the choices that the tree makes
    std::vector<double> probabilities;  // probability of each light without the tree; 1 with `all`; the sun has none
    std::size_t triangle_count = 0;
    std::size_t punctual_count = 0;  // number of punctual lights without the separate sun
    LightNeeds needs;                // `sun`: the last row is a separate sun
};

/// Sampling of the sun, the strongest directional light, if there are other lights.
enum class SunChoice : std::uint8_t {
    apart,  // sampled at every vertex in addition to another light: two shadow rays
    among,  // chosen like any other light
};
inline constexpr SunChoice kSunChoices[] = {SunChoice::apart, SunChoice::among};
const char* name(SunChoice choice);  ///< Returns "apart" or "among".

/// Returns the tables, empty if the scene has no light. Precondition: validate(scene) passes, `trace` was built from
/// it. `through`: some surface transmits light, so that light from behind counts. Throws Error for 2^29 lights or more,
/// or more than 2^26 in a tree.
LightTables build_lights(const Scene& scene, const TraceTables& trace, LightChoice choice = LightChoice::automatic,
                         SunChoice sun = SunChoice::among, bool through = false);

}  // namespace halflight
