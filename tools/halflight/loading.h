// The scene that a command line asks for.
#pragma once

#include "engine/io/gltf/gltf.h"
#include "engine/scene/scene.h"
#include "tools/halflight/arguments.h"
#include "tools/halflight/console.h"

namespace halflight {

GltfOptions gltf_options(bool allow_outside);

/// The glTF file; what loading mended or left out is said on the console.
Scene load_scene(const std::filesystem::path& path, bool allow_outside, const Console& console);

/// Sets the environment that was asked for; a scene without any light gets a neutral sky, and the console says so.
void set_environment(Scene& scene, const EnvironmentChoice& choice, const Console& console);

}  // namespace halflight
