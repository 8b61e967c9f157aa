// The appearance of a scene apart from its geometry, and changes of it that give rays of one kind.
#pragma once

#include <vector>

#include "engine/scene/scene.h"

namespace halflight::bench {

struct Appearance {
    std::vector<Material> materials;
    std::vector<PunctualLight> lights;
    Environment environment;
};
Appearance appearance_of(const Scene& scene);
void set_appearance(Scene& scene, const Appearance& appearance);

/// Returns one punctual light and no other: the scene's first directional one, else its first one, else one at
/// `fallback`.
Appearance lit_by_one_point(const Scene& scene, const dvec3& fallback);
/// Returns emissive triangles as the only lights.
Appearance lit_by_areas(const Scene& scene);
/// Returns metals of roughness 0.2; normal maps stay.
Appearance made_of_metal(const Scene& scene);
/// Returns purely diffuse materials; normal maps stay.
Appearance made_diffuse(const Scene& scene);

/// Appends a horizontal emissive square to the scene's meshes, instances and materials. remove_square() removes it
/// except for the material, which is part of the appearance.
void add_square(Scene& scene, const dvec3& centre, double side);
void remove_square(Scene& scene);

}  // namespace halflight::bench
