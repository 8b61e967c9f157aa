// Sizes of scenes, from headers alone.
#pragma once

#include "engine/io/gltf/document.h"
#include "engine/scene/scene_size.h"

namespace halflight {

struct GltfAnimatedObjects;

/// Returns the size that the scene will have in its rest pose. Reads JSON and headers of images, and decodes nothing.
/// Counts what repairs may drop. Images that cannot be read count as empty; loading names them. Throws Error like
/// load_gltf() if nodes are invalid or buffers are too short. `moving` leaves out the geometry of all nodes but
/// those whose surfaces it moves; null: all geometry counts.
SceneSize measure_gltf(GltfDocument& document, const GltfAnimatedObjects* moving = nullptr);

}  // namespace halflight
