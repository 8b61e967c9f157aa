// Makes scenes, cameras and hierarchies from command-line words.
#pragma once

#include <string>

#include "engine/rays/packed_bvh.h"
#include "engine/scene/scene.h"
#include "engine/tables/tables.h"

namespace halflight::bench {

struct NamedCamera {
    std::string name;
    Camera camera;
};
/// Returns the camera of this name or number; for an empty name the first one, or one that frames the whole scene.
/// Throws Error if there is none.
NamedCamera pick_camera(const Scene& scene, const std::string& wanted);

/// Parses "WIDTHxHEIGHT", pixels. Throws Error.
ivec2 parse_size(const std::string& text);

/// Loads a scene, and adds a sky if it has no light. `strict` is GltfOptions::strict.
Scene load_lit(const std::string& file, bool strict = false);

/// Packs the hierarchies of the tables. `nodes`: auto, grid or float.
rays::PackedScene pack(const TraceTables& tables, const std::string& nodes);

}  // namespace halflight::bench
