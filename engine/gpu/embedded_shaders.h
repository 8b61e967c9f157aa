// The shaders that are part of the library; defined by what embed_shaders.cmake writes.
#pragma once

#include <string_view>
#include <vector>

namespace halflight::gpu {

struct EmbeddedShader {
    std::string_view name;  // "shaders/lib/x.glsl"
    std::string_view text;
};
/// Sorted by name.
const std::vector<EmbeddedShader>& all_embedded_shaders();

}  // namespace halflight::gpu
