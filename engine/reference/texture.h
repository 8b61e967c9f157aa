// Texture lookups of the oracle (SHADING.md, "Lights": texture lookups).
#pragma once

#include "engine/core/math.h"
#include "engine/scene/scene.h"

namespace halflight::reference {

enum class Encoding : std::uint8_t { linear, srgb };

/// Returns RGBA in [0, 1]; srgb decodes RGB before filtering, and A is always linear. `uv` are the mesh's, before the
/// transform. Precondition: `ref` names an image of at least one texel.
dvec4 sample_texture(const Scene& scene, const TextureRef& ref, const dvec2& uv, Encoding encoding);

}  // namespace halflight::reference
