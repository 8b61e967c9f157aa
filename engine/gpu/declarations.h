// Names of the uniforms and resources that GLSL declares. No context is needed.
#pragma once

#include <functional>
#include <set>
#include <string>
#include <string_view>

namespace halflight::gpu {

using Declarations = std::set<std::string, std::less<>>;

/// Returns the uniforms and resources that the text declares, in all branches of its conditions. Each has two entries:
/// its name, "albedo", and its kind with the name, "sampler albedo". Kinds are "uniform" and those of name(SlotKind).
/// Comments, macros, other identifiers and members of blocks are left out.
Declarations declarations(std::string_view text);

}  // namespace halflight::gpu
