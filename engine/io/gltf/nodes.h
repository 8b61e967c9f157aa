// The node tree, and what hangs on it besides meshes: lights and cameras.
#pragma once

#include <vector>

#include "engine/io/gltf/document.h"

namespace halflight {

struct GltfNodes {
    std::vector<dmat4> world;  // per node; affine, each element within float32's range
    std::vector<int> shown;    // nodes of the scene, parents first, each once
};

/// Throws Error: a node with two parents, below itself, or with a transform beyond float32's range.
GltfNodes resolve_nodes(GltfDocument& document);

/// Whether float32 holds all elements; NaN is none.
bool within_float_range(const dmat4& m);

/// translation * rotation * scale; the rotation is a quaternion xyzw of any length, no rotation where it is zero.
dmat4 compose(const dvec3& translation, const dvec4& rotation, const dvec3& scale);

std::vector<Camera> convert_cameras(GltfDocument& document, const GltfNodes& nodes);
std::vector<PunctualLight> convert_lights(GltfDocument& document, const GltfNodes& nodes);

}  // namespace halflight
