// From a command line's words to scenes, cameras and hierarchies.
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
/// By name or number; by no name the first one, else one that sees everything. Throws Error where there is none.
NamedCamera pick_camera(const Scene& scene, const std::string& wanted);

/// "WIDTHxHEIGHT". Throws Error where it is not that.
ivec2 parse_size(const std::string& text);

/// A scene with light: a sky where it has none.
Scene load_lit(const std::string& file);

/// nodes: auto, grid, float.
rays::PackedScene pack(const TraceTables& tables, const std::string& nodes);

}  // namespace halflight::bench
