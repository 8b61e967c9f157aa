// A city of any size. A plan places models (buildings, trees, cars, ...) block by block outwards from the centre; it is
// written as instances or as unique geometry. The plan for more triangles continues the plan for fewer.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "tools/scenes/assembly.h"

namespace halflight::scenes {

/// Kinds of models; each has models of many sizes.
enum class ModelKind {
    ground_urban,
    ground_tower,
    ground_houses,
    ground_park,
    row,
    row_left,
    row_right,  // row houses stand wall to wall; left and right ones have windows on that side, seen from the front
    corner,
    tower,
    house,
    tree,
    lamp,
    car,
    bollard
};
inline constexpr std::size_t kModelKinds = 14;

struct CityModel {
    ModelKind kind;
    Mesh mesh;
};

/// Returns the materials of the city in the order in which `city_models` numbers them.
std::vector<Material> city_materials();
/// Returns all models in a fixed order. Each stands on y = 0 around the origin, its front towards +z.
std::vector<CityModel> city_models();

// Plan, in metres: blocks in a grid, with streets of 12 m between pavements.
inline constexpr double kBlockX = 84, kBlockZ = 64;  // size of a block with its pavement
inline constexpr double kPitchX = kBlockX + 12, kPitchZ = kBlockZ + 12;
inline constexpr double kLotDepth = 16, kRowLot = 15.4;  // five row houses along a block's long side
inline constexpr double kLotsX = 77, kLotsZ = 57;        // size of a block without its pavement

struct Placement {
    std::uint32_t model;  // index into city_models()
    std::uint32_t quarter_turns;
    float x, z;  // position on the ground, metres
};

/// Places models until the remaining triangles are fewer than the smallest model has. Throws Error for fewer triangles
/// than one block's ground needs.
std::vector<Placement> city_plan(const std::vector<CityModel>& models, std::uint64_t triangles);

/// Writes the city as write_assembly() does. Returns the number of triangles written.
std::uint64_t write_city(const std::filesystem::path& path, const SceneOptions& options);

}  // namespace halflight::scenes
