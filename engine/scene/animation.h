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
    // Of a material.
    base_color,  // RGBA
    metallic,
    roughness,
    emissive_factor,  // RGB
    emissive_strength,
    // Of a punctual light.
    light_color,  // RGB
    light_intensity,
    inner_cone,  // radians
    outer_cone,  // radians
    // Of a camera.
    vertical_fov,  // radians
};

/// Whose property it is.
constexpr bool of_node(AnimatedProperty p) {
    return p <= AnimatedProperty::weights;
}
constexpr bool of_material(AnimatedProperty p) {
    return p >= AnimatedProperty::base_color && p <= AnimatedProperty::emissive_strength;
}
constexpr bool of_light(AnimatedProperty p) {
    return p >= AnimatedProperty::light_color && p <= AnimatedProperty::outer_cone;
}

struct AnimationChannel {
    AnimatedProperty property = AnimatedProperty::translation;
    int target = 0;             // the file's node, material, light or camera
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
