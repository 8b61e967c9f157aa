// Names of a scene's objects for `halflight info --names`, with the options of `halflight render` that edit them.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <string>
#include <vector>

#include "engine/scene/scene.h"
#include "engine/scene/scene_tree.h"

namespace halflight {

/// Returns lists of cameras, variants, lights, materials, meshes and nodes. Each entry has a "name", a "number" and
/// "options": {option, value} pairs that select the object, or that set the values that it has.
nlohmann::ordered_json name_facts(const Scene& scene, const SceneTree& tree, const std::vector<std::string>& variants);

/// Returns the options of name_facts(), one a line, quoted for a shell.
std::string option_lines(const nlohmann::ordered_json& names);

}  // namespace halflight
