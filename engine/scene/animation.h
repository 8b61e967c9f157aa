// Animations as plain values: which keyframes drive what.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/scene/keyframes.h"

namespace halflight {

/// What of a node is driven; weights are those of its mesh's morph targets.
enum class NodeProperty : std::uint8_t { translation, rotation, scale, weights };

struct AnimationChannel {
    int node = 0;  // of the file
    NodeProperty property = NodeProperty::translation;
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
