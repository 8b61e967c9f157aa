// The environment of a file: HALFLIGHT_environment, a constant, or EXT_lights_image_based, a cube map.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "engine/io/gltf/document.h"

namespace halflight {

/// Returns what read_environment() takes: the color of HALFLIGHT_environment, else the light of the scene that is
/// shown, else null. `root` has passed check_gltf().
nlohmann::json environment_of(const nlohmann::json& root);

/// Sets the environment of the document. Of a light's images, those of the first level are its radiance, in nits. They
/// are sRGB-encoded; red, green and blue are divided by alpha (RGBD). Their place is that of Babylon.js: the cube map
/// of OpenGL 4.5, table 8.19, with X turned round. Their irradiance follows from them, so the file's coefficients are
/// not read. A light whose images cannot be read is left out, with a warning. Throws Error for colours and intensities
/// that are negative or not finite, and if options are strict also for such images.
void read_environment(const nlohmann::json& from, GltfDocument& document);

}  // namespace halflight
