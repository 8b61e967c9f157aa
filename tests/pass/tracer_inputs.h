// Scenes and rays for tests of tracers.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "engine/scene/scene.h"
#include "engine/tables/tables.h"
#include "shaders/shared/rays.h"

namespace halflight::test {

using shared::Ray;

/// glTF files below a folder that are meant to load, sorted.
std::vector<std::filesystem::path> scenes_under(const std::filesystem::path& folder);
/// The scene's tables with all coverage 1. flatten: see build_trace_tables.
TraceTables opaque_tables(const Scene& scene, std::size_t flatten);

/// Scenes of one material; each function returns an index or a scene of one mesh and one instance.
int add_mesh(Scene& scene, const std::vector<vec3>& positions, const std::vector<uvec3>& triangles);
void add_instance(Scene& scene, int mesh, const dmat4& object_to_world = dmat4(1));
Scene of_one_mesh(const std::vector<vec3>& positions, const std::vector<uvec3>& triangles);
/// Closed, n x 2n quads, poles included: every edge has two triangles.
Scene sphere(unsigned n, const vec3& centre, float radius);
/// n x n quads over [-1, 1]^2 in x and z.
Scene height_field(unsigned n, float height);
/// Triangles with centres in [-1, 1]^3 and corners within size * stretch of them.
Scene soup(unsigned count, float size, const vec3& stretch, std::uint32_t seed);
/// 60 instances of a sphere, turned, scaled and moved in all ways, over an instance of a height field.
Scene instanced_spheres();
/// Squares over [0, 1]^2, one above the other, each of its own share of coverage.
Scene veils(int count);

/// Rays that look through the scene from all sides: from points in and around its bounds, to points in it.
std::vector<Ray> rays_through(const Bounds& bounds, std::size_t count, std::uint32_t seed);
/// 64 x 64 pixels in tiles of 8 x 8, row by row; jitter: where in its pixel a ray is, [0, 1]^2.
std::vector<Ray> camera_rays(const vec3& from, const vec3& to, const vec2& jitter = vec2(0.5f));
/// From a point outside towards the centre of the bounds.
std::vector<Ray> camera_rays(const Bounds& bounds, const vec3& from_direction);
/// Rays of all sorts: rays_through(), two cameras, and 100 tiles of 64 rays each from about one point to about
/// another one in the bounds, which may end there.
std::vector<Ray> mixed_rays(const Bounds& bounds, std::size_t count, std::uint32_t seed = 1);
/// Tiles of 64 rays or fewer through [-1, 1]^3 that are alike in some way, or not at all: one ray, the same one many
/// times, opposite directions, one origin, zero components, t_max 0 or infinite, dead rays, directions and origins of
/// all magnitudes.
std::vector<std::vector<Ray>> degenerate_tiles();

/// Some of the paths 0 to count - 1, most in order, many of them backwards, none twice. count: at least 6000.
std::vector<std::uint32_t> uneven_list(std::uint32_t count);

}  // namespace halflight::test
