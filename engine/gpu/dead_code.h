// Removal of GLSL that a variant leaves out. No context is needed.
//
// Kernels include whole files of shaders/lib and branch on constants (shader_source.h). Drivers would parse, link and
// optimize all of that before they drop it, which takes twice as long as the code that is left.
#pragma once

#include <string>

#include "engine/gpu/shader_source.h"

namespace halflight::gpu {

/// Returns the text without comments, without branches whose conditions are constant, and without functions and
/// constants that main() does not reach then. Lines keep their numbers. Text without main() or with unmatched brackets
/// stays as it is. A macro HALFLIGHT_X that neither `defines` nor the text defines is 0.
std::string without_dead_code(const std::string& text, const Defines& defines);

}  // namespace halflight::gpu
