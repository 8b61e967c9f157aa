// Shader texts that are compiled in. embed_shaders.cmake writes the definitions.
#pragma once

#include <string_view>
#include <vector>

namespace halflight::gpu {

struct EmbeddedShader {
    std::string_view name;  // name from the project's root: "shaders/lib/x.glsl"
    std::string_view text;
};
/// Returns the shaders of the library, sorted by name.
const std::vector<EmbeddedShader>& all_embedded_shaders();

}  // namespace halflight::gpu
