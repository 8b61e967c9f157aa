// Surfaces that are seen in mirrors and through clear glass: their properties guide the denoiser.
//
// A specular chain follows the camera ray of a path over mirrors and interfaces of glass, always by the strongest
// branch, to the first surface that is neither. Glossy light of the path's first surface comes mainly from there.
#pragma once

#include "passes/steps/paths.h"
#include "passes/steps/surfaces.h"

namespace halflight {

struct SpecularChains {
    graph::BufferHandle chains;  // one SpecularChain (shaders/shared/chain_records.h) per path
    graph::BufferHandle places;  // one ChainPlace per path; empty unless requested
};

struct SpecularChainOptions {
    int bounces = 0;      // bounces of paths, > 0; chains are not longer
    bool places = false;  // makes places; rough lobes then count as perfect mirrors
};

/// Follows the chains that begin at the first surfaces of all paths.
SpecularChains add_specular_chains(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer,
                                   const SpecularChainOptions& options);

}  // namespace halflight
