// What a scene looks like apart from its geometry, and the changes that give rays of one kind.
#pragma once

#include <vector>

#include "engine/scene/scene.h"

namespace halflight::bench {

struct Look {
    std::vector<Material> materials;
    std::vector<PunctualLight> lights;
    Environment environment;
};
Look look_of(const Scene& scene);
void wear(Scene& scene, const Look& look);

/// One punctual light and no other: the scene's first directional one, else its first one, else one at `fallback`.
Look lit_by_one_point(const Scene& scene, const dvec3& fallback);
/// Emissive triangles only.
Look lit_by_areas(const Scene& scene);
/// Metal of roughness 0.2; normal maps stay.
Look made_of_metal(const Scene& scene);
/// Nothing but diffuse reflection; normal maps stay.
Look made_diffuse(const Scene& scene);

/// A horizontal emissive square, appended to the scene's meshes, instances and materials; remove_square takes
/// it away but for the material, which is part of the look.
void add_square(Scene& scene, const dvec3& centre, double side);
void remove_square(Scene& scene);

}  // namespace halflight::bench
