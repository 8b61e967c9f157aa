// The rays that tracers are measured with: what a frame of a renderer asks for.
#pragma once

#include <string>
#include <vector>

#include "engine/scene/scene.h"
#include "engine/scene/tables.h"
#include "shaders/shared/rays.h"
#include "tools/bench/embree_tracer.h"

namespace halflight::bench {

struct RaySet {
    std::string kind;
    bool any_hit = false;
    bool coherent = false;
    std::vector<shared::Ray> rays;  // in tile order (shaders/shared/pixel_order.h), a multiple of 256
    std::size_t live = 0;           // the others have no surface to start from
    float tolerance = 0;            // of t: 2^-20 of the scene's diagonal, all directions being of unit length
};

/// Names in the order of reports.
const std::vector<std::string>& ray_kinds();

/// Of all kinds: primary rays through the pixels' centres, and from what they hit
///   hard: to the scene's first directional or point light, else to a point above the camera
///   soft: the same within 3 degrees (directional), or within a square of 1/20 of the scene's diagonal
///   glossy: reflections by a GGX microfacet of roughness 0.2
///   diffuse: cosine-distributed
///   ao: cosine-distributed, as long as 1/20 of the scene's diagonal
std::vector<RaySet> make_rays(const Scene& scene, const TraceTables& tables, const EmbreeTracer& tracer,
                              const Camera& camera, int width, int height);

}  // namespace halflight::bench
