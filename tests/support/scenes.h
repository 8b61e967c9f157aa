// Makes small scenes with known results, for tests.
#pragma once

#include "engine/scene/scene.h"

namespace halflight::test {

// All materials are seen from both sides.

/// Returns a purely diffuse material. It has no Fresnel reflection, which would take light from the base.
Material diffuse_material(const vec3& albedo);
Material metal_material(const vec3& albedo, float roughness);
/// Returns white glass, which rays cross through both interfaces.
Material glass_material(float roughness, float ior = 1.5f);
/// Returns a material that emits and reflects nothing.
Material light_material(const vec3& radiance);

// Each of these functions returns the index of what it adds. Each quad and box is a mesh of its own with one instance.

int add_material(Scene& scene, const Material& material);
/// Adds a quad with corners p, p + u, p + u + v, p + v, facing cross(u, v); texture coordinates (0, 0), (1, 0), (1, 1),
/// (0, 1).
int add_quad(Scene& scene, int material, const vec3& p, const vec3& u, const vec3& v);
/// Adds an axis-aligned box that faces outwards.
int add_box(Scene& scene, int material, const vec3& lower, const vec3& upper);
/// Adds a ball of flat faces that face outwards.
int add_ball(Scene& scene, int material, const vec3& centre, float radius, int rings = 8);
/// Adds a ball with the vertex normals of a sphere.
int add_smooth_ball(Scene& scene, int material, const vec3& centre, float radius, int rings = 6);

/// Returns a box of 2 units about the origin, open towards +Z. It has red and green walls, two blocks, a light under
/// the ceiling and a camera. The taller block is of material `tall`.
Scene cornell_box(const Material& tall = diffuse_material(vec3(0.73f)));

}  // namespace halflight::test
