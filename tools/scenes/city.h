// A city of any size. A plan places models (buildings, trees, cars, ...) block by block outwards from the centre; it is
// written as instances or as unique geometry. The plan for more triangles continues the plan for fewer.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "tools/scenes/document.h"

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

struct Model {
    ModelKind kind;
    Mesh mesh;
};

/// Returns the materials of the city in the order in which `city_models` numbers them.
std::vector<Material> city_materials();
/// Returns all models in a fixed order. Each stands on y = 0 around the origin, its front towards +z.
std::vector<Model> city_models();

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
std::vector<Placement> city_plan(const std::vector<Model>& models, std::uint64_t triangles);

struct CityOptions {
    std::uint64_t triangles = 1'000'000;
    bool flatten = false;                               // writes unique geometry instead of nodes that share meshes
    bool gpu_instancing = false;                        // writes one node per model (EXT_mesh_gpu_instancing)
    bool parts = false;                                 // writes several files; with flatten only
    std::uint64_t part_bytes = std::uint64_t{1} << 30;  // upper limit of a part's size
};

/// Writes `path`, or with `parts` its parts beside it ("city.000.glb", ...) and then "city.parts.json", which lists
/// them:
/// {"triangles": n, "parts": [{"uri", "triangles", "bytes", "min": [x, y, z], "max": [x, y, z]}, ...]}.
/// The first part has cameras, sun and sky. Returns the number of triangles written.
std::uint64_t write_city(const std::filesystem::path& path, const CityOptions& options);

}  // namespace halflight::scenes
