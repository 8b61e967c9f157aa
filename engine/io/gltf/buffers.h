// Buffers of a glTF file, and the compressed contents of its buffer views.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "engine/io/gltf/document.h"

namespace halflight {

/// Takes the buffers out of the JSON and opens them, because compressed views decide which are needed. Finds the
/// compressed buffer views; fallback buffers are opened only if a view needs them.
void take_buffers(nlohmann::json& root, GltfDocument& document, const ByteSource& binary_chunk);

}  // namespace halflight
