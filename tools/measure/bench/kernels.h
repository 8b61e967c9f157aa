// Kernels that only measurements use.
#pragma once

#include <string>
#include <string_view>

#include "engine/gpu/embedded_shaders.h"
#include "engine/gpu/shader_source.h"

namespace halflight::gpu {

/// Returns the kernels of this folder, sorted by name.
const std::vector<EmbeddedShader>& bench_kernels();

/// Returns the kernel "tools/measure/bench/NAME", which must exist.
inline ShaderSource bench_kernel(std::string_view name) {
    const std::string path = "tools/measure/bench/" + std::string(name);
    for (const EmbeddedShader& kernel : bench_kernels())
        if (kernel.name == path) return {path, std::string(kernel.text)};
    return {path};  // the program cache reports that there is no such file
}

}  // namespace halflight::gpu
