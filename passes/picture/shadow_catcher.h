// Shadow catchers: the light that falls on them, with and without the other objects.
#pragma once

#include "passes/picture/accumulate.h"

namespace halflight {

inline constexpr std::size_t kCatcherSums = 6;  ///< doubles per path of Accumulated::catchers

/// Adds the light samples of a sample to the sums of shadow catchers, Accumulated::catchers, and counts bad values in
/// `sums`, which add_accumulate() has returned. An occluded sample counts for the light without the other objects if
/// no catcher occludes it: its ray is traced once more, through all other surfaces.
void add_shadow_catchers(graph::Graph& graph, const SceneView& view, const SampleInputs& sample, Accumulated& sums);

}  // namespace halflight
