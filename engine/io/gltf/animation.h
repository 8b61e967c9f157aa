// glTF's animations as plain values.
#pragma once

#include <vector>

#include "engine/scene/animation.h"

namespace halflight {

struct GltfDocument;

/// All animations of the file, in its order. What a channel drives that is no AnimatedProperty is left out with a
/// warning. Throws Error that names animation, channel or sampler: not of the schema, of the wrong type or length, keys
/// that are not finite or not in order, a node that has a matrix, weights of a mesh without morph targets, a pointer
/// that leads nowhere.
std::vector<Animation> read_animations(GltfDocument& document);

}  // namespace halflight
