// From a camera to the constants that kernels read.
#pragma once

#include "engine/device/scene_view.h"
#include "engine/settings/estimator.h"
#include "engine/settings/frame_settings.h"
#include "engine/tables/tables.h"
#include "shaders/shared/frame.h"

namespace halflight {

/// Where and how a sample of a band looks at the scene.
struct SampleView {
    Band band;
    vec2 jitter{0.5f};               // sample point of every pixel, from its upper left corner, pixels
    std::uint32_t sample = 0;        // index in its sequence
    std::uint32_t seed = 0;          // of the sequences of all pixels
    std::uint32_t shared_count = 0;  // > 0: the one that they share has so many samples of each in a row (a power of 2)
    bool begins = true;              // is the picture's first sample, with which its sums begin
};

/// `origin`: TraceTables::origin. `previous`: the camera of the frame before. `reach`: world units, the scene lies
/// within this distance of the camera; decides the near plane where the camera leaves it open.
shared::Frame frame_constants(const Camera& camera, const Camera& previous, const dvec3& origin, double reach,
                              const SampleView& view);

/// The points that a frame's samples have: those of `sobol` where blue noise is wanted, but samples are many or not
/// counted beforehand.
SamplePoints points_of(const FrameSettings& frame, SamplePoints wanted);
/// Of sample `index` of a frame: all pixels look through the same point of the filter, as rasterizing demands, and
/// seeds of different frames and of different user seeds share nothing.
SampleView sample_view(const FrameSettings& frame, const Band& band, std::uint32_t index, SamplePoints points);
/// The same with one of `count` points of its own, which together are samples of `count` times as long a sequence.
SampleView seen_view(const SampleView& sample, const PixelFilter& filter, int number, int count);
shared::Frame frame_constants(const FrameSettings& frame, const TraceTables& tables, const SampleView& view);

/// World to OpenGL clip space of the whole image: +y up, reversed depth (near 1, far 0). Orthographic cameras use
/// `reach`.
dmat4 world_to_clip(const Camera& camera, const ivec2& image, double reach);

}  // namespace halflight
