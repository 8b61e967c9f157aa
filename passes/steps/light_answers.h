// Answers to the shadow rays of a sample, at the first surface and behind it.
#pragma once

#include "engine/device/scene_view.h"

namespace halflight {

struct DirectLightEstimate {
    // DirectLight per ray, as if visible, weighted for the mean. The first shadow rays of all paths come first, then
    // the second ones and so on. Last come the sun rays of all paths, if the sun is sampled separately.
    graph::BufferHandle light;
    graph::BufferHandle occluded;      // uint per shadow ray, in the same order: answer (passes/steps/panes.h)
    graph::BufferHandle sun_occluded;  // uint per path: answer for the sun; empty unless the sun is sampled separately
    rays::RayBatch rays{};             // batch of the shadow rays
    rays::RayBatch sun_rays{};         // batch of the sun rays; empty like sun_occluded
};

/// Answers to the last shadow rays of the paths. All other light of later bounces is in PathState.
struct Continuation {
    graph::BufferHandle occluded;      // uint per path, valid if PathState::pending is; empty without light samples
    graph::BufferHandle sun_occluded;  // uint per path: answer for the sun; empty unless the sun is sampled separately
    bool indirect = true;              // whether there are bounces after the first
};

}  // namespace halflight
