// The buildings of the city.
#pragma once

#include "tools/scenes/city.h"

namespace halflight::scenes {

/// Indices into city_materials().
enum class CityMaterial : int {
    asphalt,
    pavement,
    marking,
    grass,
    gravel,
    brick,
    dark_brick,
    sandstone,
    white_render,
    ochre_render,
    rose_render,
    grey_stone,
    concrete,
    trim,
    glass,
    curtain,
    door,
    tiles,
    slate,
    steel,
    bark,
    leaf,
    dark_leaf,
    water,
    red_paint,
    white_paint,
    blue_paint,
    grey_paint,
    tyre
};

struct BuildingSpec {
    double width, depth;  // size along x and z, metres
    int floors;
    CityMaterial wall;
    std::uint32_t seed;
    int open_side = 0;  // -1, +1: this side (x) has windows too; 0: neighbours stand wall to wall
};

/// Makes a building with a shop floor and rows of recessed windows, some with balconies. Its roof is flat with huts, or
/// pitched with dormers.
Mesh row_building(const BuildingSpec& spec);
/// Makes a free-standing high-rise: a base, a shaft of glass and fins with a setback, machinery on the roof.
Mesh tower_building(const BuildingSpec& spec);
/// Makes a detached house with a gable roof, a porch and a chimney.
Mesh house(const BuildingSpec& spec);

}  // namespace halflight::scenes
