// Small scenes made by hand, for tests whose answer is known.
#pragma once

#include "engine/scene/scene.h"

namespace halflight::test {

/// Diffuse and nothing else: no Fresnel reflection takes light from the base.
Material diffuse_material(const vec3& albedo);
Material metal_material(const vec3& albedo, float roughness);
/// Emits, reflects nothing.
Material light_material(const vec3& radiance);

/// Each returns the index of what it adds. Quads and boxes are meshes of their own with one identity instance.
int add_material(Scene& scene, const Material& material);
/// Corners p, p + u, p + u + v, p + v; faces cross(u, v); texture coordinates (0, 0), (1, 0), (1, 1), (0, 1).
int add_quad(Scene& scene, int material, const vec3& p, const vec3& u, const vec3& v);
/// Axis-aligned, faces outwards.
int add_box(Scene& scene, int material, const vec3& lower, const vec3& upper);

/// A box of 2 units about the origin, open towards +Z, red and green walls, two blocks, a light under the ceiling;
/// `tall` is the material of the tall block. Comes with a camera.
Scene cornell_box(const Material& tall = diffuse_material(vec3(0.73f)));

}  // namespace halflight::test
