// What may differ from one picture of a scene to the next.
#pragma once

#include <cstdint>
#include <optional>

#include "engine/scene/scene.h"

namespace halflight {

struct FrameSettings {
    Camera camera;
    std::optional<Camera> previous_camera{};  // of the frame before, for the motion output; without: `camera`
    int samples = 64;                         // per pixel, > 0
    double time_limit = 0;    // seconds; > 0: samples are added until it is spent, at least one, `samples` at most
    std::uint32_t seed = 0;   // independent pictures of the same frame
    std::uint32_t frame = 0;  // frame number: other noise for every frame
};

}  // namespace halflight
