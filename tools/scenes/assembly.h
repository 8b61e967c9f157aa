// Scenes of any size as placed models. Models are made when they are needed and dropped after their last use, so memory
// stays bounded. A scene is written as instances or as unique geometry, in one file or in several.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tools/scenes/document.h"

namespace halflight::scenes {

struct SceneOptions {
    std::uint64_t triangles = 1'000'000;                // instances count as often as they are used
    bool flatten = false;                               // writes unique geometry instead of nodes that share meshes
    bool gpu_instancing = false;                        // writes one node per model (EXT_mesh_gpu_instancing)
    bool parts = false;                                 // writes several files; implies flatten in the program
    std::uint64_t part_bytes = std::uint64_t{1} << 30;  // upper limit of a part's size
};

struct Model {
    std::string name;
    std::function<Mesh()> make;  // returns equal meshes on every call
};

/// A model in the scene: turned, then moved. Turns by multiples of 90 degrees about an axis are exact.
struct Placed {
    std::uint32_t model = 0;  // index into Assembly::models
    mat3 turn{1};             // rotation
    vec3 at{0};               // metres
};

struct Assembly {
    std::string name;
    std::string group;  // noun that names the meshes of unique geometry
    std::vector<Material> materials;
    std::vector<Model> models;
    std::vector<Placed> places;                                        // neighbours in space should follow each other
    std::function<void(Document&, const Bounds& bounds)> add_views{};  // adds cameras, lights and surroundings

    std::uint32_t add(std::string model_name, std::function<Mesh()> make);  ///< Adds a model and returns its index.
    void place(std::uint32_t model, const dmat4& matrix = dmat4(1));  ///< Adds a placement; `matrix` must be rigid.
};

/// Returns the bounds of all placed models; makes each model.
Bounds bounds_of(const Assembly& assembly);

/// Writes `path`, or with `parts` its parts beside it ("city.000.glb", ...) and then "city.parts.json", which lists
/// them:
/// {"triangles": n, "parts": [{"uri", "triangles", "bytes", "min": [x, y, z], "max": [x, y, z]}, ...]}.
/// The first part has cameras and lights. Returns the number of triangles written.
std::uint64_t write_assembly(const std::filesystem::path& path, const Assembly& assembly, const SceneOptions& options);

/// Returns the scene whose number of triangles comes closest to `triangles`. `make` returns the scene of a level of
/// detail, a positive number with which the number of triangles grows. Throws Error if the coarsest form has 5 %
/// more triangles than that.
Assembly fitted(std::uint64_t triangles, const std::function<Assembly(double level)>& make);

}  // namespace halflight::scenes
