// Animations as plain values: keyframes and the properties that they drive.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/error.h"
#include "engine/scene/keyframes.h"

namespace halflight {

/// Property that an animation drives.
enum class AnimatedProperty : std::uint8_t {
    // Properties of a node. `weights` belong to the morph targets of its mesh.
    translation,
    rotation,
    scale,
    visibility,
    weights,
    mesh_weights,  // weights of a mesh, for its nodes without weights of their own
    // Properties of a material.
    emission,    // emission, or the transform of the emission texture
    normal_map,  // transform of a normal map, which tangents follow
    surface,     // any other property
    // Any property of a punctual light, or of a camera.
    light,
    camera,
};

/// Returns whether the property belongs to a node.
constexpr bool of_node(AnimatedProperty p) {
    return p <= AnimatedProperty::weights;
}

struct AnimationChannel {
    AnimatedProperty property = AnimatedProperty::translation;
    int target = 0;             // index of the file's node, mesh, material, light or camera
    int field = 0;              // the driven field; channels of equal target and field drive the same numbers
    std::size_t keyframes = 0;  // index into Animation::keyframes
};

struct Animation {
    std::string name;             // name; may be empty, need not be unique
    std::optional<Error> damage;  // why it cannot play; unset: it can. A damaged animation has no channels.
    std::vector<Keyframes> keyframes;
    std::vector<AnimationChannel> channels;
    double begin = 0;  // seconds, time of the first key that a channel uses
    double end = 0;    // seconds, time of the last key that a channel uses
};

}  // namespace halflight
