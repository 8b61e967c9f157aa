// Sizes of scenes, from headers alone.
#pragma once

#include "engine/io/gltf/document.h"
#include "engine/scene/scene_size.h"

namespace halflight {

/// Returns the size that the scene will have in its rest pose. Reads JSON and headers of images, and decodes nothing.
/// Counts what repairs may drop. Images that cannot be read count as empty; loading names them. Throws Error like
/// load_gltf() where nodes are invalid or buffers are too short.
SceneSize measure_gltf(GltfDocument& document);

}  // namespace halflight
