// Animations as plain values: which keyframes drive what.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/scene/keyframes.h"

namespace halflight {

/// What is driven.
enum class AnimatedProperty : std::uint8_t {
    // Of a node; weights are those of its mesh's morph targets.
    translation,
    rotation,
    scale,
    weights,
    mesh_weights,  // of a mesh, for nodes of it that have none of their own
    // Of a material.
    emission,    // how much it emits, and where
    normal_map,  // where a texture of normals lies, which tangents follow
    surface,     // anything else
    // Of a punctual light, of a camera.
    light,
    camera,
};

/// Whose property it is.
constexpr bool of_node(AnimatedProperty p) {
    return p <= AnimatedProperty::weights;
}

struct AnimationChannel {
    AnimatedProperty property = AnimatedProperty::translation;
    int target = 0;             // the file's node, mesh, material, light or camera
    int field = 0;              // which of its numbers: channels of one target and field drive the same thing
    std::size_t keyframes = 0;  // index into Animation::keyframes
};

struct Animation {
    std::string name;  // may be empty, and need not be the only one of its name
    std::vector<Keyframes> keyframes;
    std::vector<AnimationChannel> channels;
    double begin = 0;  // seconds, of the first key that a channel uses
    double end = 0;    // seconds, of the last one
};

}  // namespace halflight
