// Frame options from the settings of a picture. Pure: no OpenGL.
#pragma once

#include "renderer/needs.h"
#include "renderer/render.h"

namespace halflight {

/// Returns the options of samples without the radiance cache. The settings' primary visibility must not be automatic,
/// and their estimator must leave nothing open. asked: the estimator before a pilot settled it.
FrameOptions frame_options(const RenderSettings& settings, const Estimator& asked);
/// Returns the options of samples with the radiance cache, from those of samples without.
FrameOptions cached_options(FrameOptions options);
/// Returns the options of samples of listed blocks, from those of samples of all pixels.
FrameOptions listed_options(FrameOptions options);

}  // namespace halflight
