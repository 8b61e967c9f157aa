// The results of a sample, and the sums over samples.
#pragma once

#include <optional>

#include "passes/steps/light_answers.h"
#include "passes/steps/paths.h"
#include "passes/steps/surfaces.h"

namespace halflight {

/// Results of one sample. Parts that the frame leaves out are empty.
struct SampleInputs {
    GBuffer gbuffer;
    std::optional<DirectLightEstimate> direct;
    std::optional<PathBuffers> paths;
    std::optional<Continuation> continuation;
    // vec4 per path: emission seen by extra camera rays (add_seen); then those of its light groups
    graph::BufferHandle seen;
    // vec4 per path: light of the lamps that the camera ray meets (add_shown_lamps); then those of its light groups.
    // Empty if `seen` has it, or if no lamps are shown.
    graph::BufferHandle lamps;
    graph::BufferHandle chains;  // SpecularChain per path (add_specular_chains)
    // DirectLight per path: indirect light from the group (add_reuse); then those of each light group
    graph::BufferHandle received;
};

inline constexpr std::size_t kCatcherSums = 9;  ///< doubles per path of Accumulated::catchers

/// Sums over all samples so far, at the path's index. Handles of parts that the frame leaves out are empty.
struct Accumulated {
    graph::BufferHandle emission;  // 4 doubles: rgb, coverage (1 for every sample that met a surface)
    graph::BufferHandle direct;    // 6 doubles: diffuse rgb, glossy rgb; light met by next-event estimation or by a ray
    graph::BufferHandle indirect;  // 6 doubles: diffuse rgb, glossy rgb
    graph::BufferHandle squares;   // 3 doubles: squares of the samples' beauty, for its variance
    graph::BufferHandle groups;    // 3 doubles for each light group: rgb of all light of its lights
    // kCatcherSums doubles (add_shadow_catchers): luminance of the light on shadow catchers, with all objects and with
    // catchers alone. The number of samples that met a catcher follows, rgb of the background behind them, and the
    // square of the first luminance, its product with the second one, and the square of that.
    graph::BufferHandle catchers;
    graph::BufferHandle features;  // 6 doubles: albedo rgb (diffuse, transmitted and specular at normal
                                   // incidence), shading normal xyz (world); zero where there is no surface
    // kHalfSums doubles for the denoiser. 0 to 8: direct diffuse, indirect diffuse and glossy rgb of the first half of
    // the samples. 9 to 11: diffuse albedo of all samples. 12: ln(depth along the camera's axis) of all samples.
    // kChainSums doubles follow if SampleInputs::chains is set. They are sums of the differences that chains make.
    // 13 to 15: albedo of glossy light. 16 to 18: normal. 19: ln(depth). 20: number of bounces of the chain.
    graph::BufferHandle halves;
    graph::BufferHandle bad_values;  // kBadValueCounts uints (shaders/shared/path_state.h): values replaced by zero
};

/// Declares that the kernel of a pass reads the sums of emission, direct and indirect light as its storage blocks
/// Emission, Direct and Indirect. Sets HALFLIGHT_DIRECT and HALFLIGHT_INDIRECT if these sums exist.
void read_light(graph::Pass& pass, gpu::Defines& defines, const Accumulated& sums);

}  // namespace halflight
