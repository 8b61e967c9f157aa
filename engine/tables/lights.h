// Lights as shaders/shared/{light,environment}.h lay them out, and how they are picked.
//
// A light is picked by its share of the radiant power (of luminance, in nit m^2 sr): an emissive triangle 2 pi A L, a
// point 4 pi I, a spot I times the solid angle of its cone, a directional light E times the scene's shadow disk pi R^2,
// the environment pi R^2 int L dw. Since the latter two grow with the scene while what they light may be one room of
// it, a quarter of the choices goes in equal parts to the kinds that are present (triangles, points and spots,
// directional, environment). Since a light may be dim and yet the only one that its room sees, an eighth goes in equal
// parts to all of them.
//
// Where there are many, all that the triangles, points and spots have together, but for that eighth, goes to a light
// tree (light_tree.h), which shares it out anew for each place that is to be lit.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/core/image.h"
#include "engine/tables/tables.h"

namespace halflight {

enum class LightChoice : std::uint8_t {
    automatic,  // the tree from kTreeLights on, power below
    power,
    tree,     // power where there are fewer than two lights that it could hold
    uniform,  // all alike: what the others are compared with
};
inline constexpr LightChoice kLightChoices[] = {LightChoice::automatic, LightChoice::power, LightChoice::tree,
                                                LightChoice::uniform};
const char* name(LightChoice choice);  ///< "auto", "power", "tree", "uniform"
inline constexpr std::size_t kTreeLights = 16;

struct LightTables {
    // UNIT_LIGHTS: triangles, then punctual lights, then the environment, then the sun that is apart
    std::vector<vec4> rows;
    std::vector<vec2> alias;                       // UNIT_LIGHT_ALIAS
    std::vector<std::uint32_t> light_of_triangle;  // UNIT_LIGHT_OF_TRIANGLE; empty without emissive triangles
    Image environment;                             // UNIT_ENVIRONMENT; empty where it is black
    std::vector<vec4> environment_cells;           // UNIT_ENVIRONMENT_ALIAS
    std::vector<uvec4> tree;                       // UNIT_LIGHT_TREE; empty where lights are chosen otherwise
    LightChoice choice = LightChoice::power;       // what was made of `automatic`
    double tree_share = 0;                         // of the choices, that the tree decides
    std::vector<double> probabilities;             // of each light, without what the tree adds; not of the sun
    std::size_t triangle_count = 0;
    std::size_t punctual_count = 0;  // without the sun
    bool sun = false;                // the last row is not among those that are chosen from
};

/// How the sun, the strongest directional light, is sampled where there are other lights.
enum class SunChoice : std::uint8_t {
    apart,  // at every vertex, beside one of the others: two shadow rays
    among,  // as one of them
};
inline constexpr SunChoice kSunChoices[] = {SunChoice::apart, SunChoice::among};
const char* name(SunChoice choice);  ///< "apart", "among"

/// Empty where nothing shines. Precondition: validate(scene) passes, `trace` was built from it. Throws Error for 2^29
/// lights or more, or more than 2^26 of a tree.
LightTables build_lights(const Scene& scene, const TraceTables& trace, LightChoice choice = LightChoice::automatic,
                         SunChoice sun = SunChoice::among);

/// Importance of an environment map. Directions within a cell are uniform, so the best weight is the root of solid
/// angle times the integral of the squared luminance; bilinear interpolation being convex, that integral is bounded by
/// the filtered squares of the texels. 0 only where every bilinear lookup in the cell is 0.
struct EnvironmentCells {
    int columns = 0;
    int rows = 0;
    std::vector<double> weights;       // row-major from the top
    std::vector<double> solid_angles;  // of one cell of each row, sr
    double integral = 0;               // of the luminance over the sphere, nit sr
};
/// A texel each, unless that were more than max_cells.
EnvironmentCells environment_cells(const Image& map, int max_cells = 1 << 21);

}  // namespace halflight
