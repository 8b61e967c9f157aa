// Makes scenes and rays for tests of tracers.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "engine/scene/scene.h"
#include "engine/tables/tables.h"
#include "shaders/shared/ray_structs.h"

namespace halflight::test {

using shared::Ray;

/// Returns the valid glTF files below a folder, sorted.
std::vector<std::filesystem::path> scenes_under(const std::filesystem::path& folder);
/// Returns the scene's tables with all coverage set to 1. `flatten` is that of build_trace_tables().
TraceTables opaque_tables(const Scene& scene, std::size_t flatten);

/// Adds a mesh to a scene; returns its index. The functions below return scenes of one material, mesh and instance.
int add_mesh(Scene& scene, const std::vector<vec3>& positions, const std::vector<uvec3>& triangles);
void add_instance(Scene& scene, int mesh, const dmat4& object_to_world = dmat4(1));
Scene of_one_mesh(const std::vector<vec3>& positions, const std::vector<uvec3>& triangles);
/// Returns a closed sphere of n x 2n quads including the poles; every edge belongs to two triangles.
Scene sphere(unsigned n, const vec3& centre, float radius);
/// Returns n x n quads over [-1, 1]^2 in x and z.
Scene height_field(unsigned n, float height);
/// Returns triangles with centres in [-1, 1]^3 and corners within size * stretch of them.
Scene soup(unsigned count, float size, const vec3& stretch, std::uint32_t seed);
/// Returns 60 instances of a sphere with various transforms, above an instance of a height field.
Scene instanced_spheres();
/// Returns stacked squares over [0, 1]^2, each with its own coverage.
Scene veils(int count);

/// Returns rays from points in and around the scene's bounds to points in the bounds.
std::vector<Ray> rays_through(const Bounds& bounds, std::size_t count, std::uint32_t seed);
/// Returns the rays of 64 x 64 pixels in tiles of 8 x 8, row by row. `jitter` is the position in the pixel, [0, 1]^2.
std::vector<Ray> camera_rays(const vec3& from, const vec3& to, const vec2& jitter = vec2(0.5f));
/// Returns camera rays from a point outside towards the centre of the bounds.
std::vector<Ray> camera_rays(const Bounds& bounds, const vec3& from_direction);
/// Returns rays of all kinds: rays_through(), two cameras, and 100 tiles. The 64 rays of a tile lead from near one
/// point of the bounds to near another, where they may end.
std::vector<Ray> mixed_rays(const Bounds& bounds, std::size_t count, std::uint32_t seed = 1);
/// Returns tiles of at most 64 rays through [-1, 1]^3. Rays are single, equal, opposite, inactive or of common origin,
/// have zero components or t_max 0 or infinite, and have all magnitudes.
std::vector<std::vector<Ray>> degenerate_tiles();

/// Makes every seventh ray and the first 100 rays inactive.
void kill_some(std::vector<Ray>& rays);

/// Returns some of the paths 0 to count - 1 without duplicates. Most are in order, many reversed. Precondition: count
/// >= 6000.
std::vector<std::uint32_t> uneven_list(std::uint32_t count);

}  // namespace halflight::test
