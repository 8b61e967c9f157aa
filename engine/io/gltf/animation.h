// Animations of glTF files as plain values.
#pragma once

#include <vector>

#include "engine/core/memory_ledger.h"
#include "engine/scene/animation.h"

namespace halflight {

struct GltfDocument;

/// Reads all animations of the file, in its order. A channel that drives no AnimatedProperty is ignored with a warning,
/// and so are violations of the specification that do not change how an animation plays. An animation is damaged
/// (Animation::damage names animation, channel or sampler), if it
/// - violates the schema or has the wrong type or length,
/// - has keys that are not finite or not in order,
/// - drives a node with a matrix, or weights of a mesh without morph targets,
/// - has a pointer without target.
/// Throws Error for a list that is not an array, and BudgetError if the keyframes do not fit into the memory budget.
/// `memory` becomes the entry of all keyframes. It grows while they are read.
std::vector<Animation> read_animations(GltfDocument& document, MemoryLedger::Entry& memory);

}  // namespace halflight
