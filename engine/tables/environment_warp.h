// Importance of environment maps, and the hierarchy by which shaders sample them (shaders/shared/environment_texels.h).
#pragma once

#include <vector>

#include "engine/core/image.h"
#include "engine/core/math.h"

namespace halflight {

/// Importance of an environment map. Directions within a cell of one texel follow the luminance, so the weight is its
/// integral. Places in u and v within a larger cell are uniform, so the best weight is about the square root of solid
/// angle times the integral of the squared luminance. Bilinear interpolation is convex, so the filtered squares of the
/// texels bound that integral. A weight is 0 only if every bilinear lookup in the cell is 0.
struct EnvironmentCells {
    int columns = 0;
    int rows = 0;
    ivec2 texels{0};                   // columns and rows of the map
    std::vector<double> weights;       // weight of each cell, row-major from the top
    std::vector<double> solid_angles;  // solid angle of a cell of each row, sr
    double integral = 0;               // integral of the luminance over the sphere, nit sr
};
/// Returns one cell per texel, or larger cells if these would be more than max_cells.
EnvironmentCells environment_cells(const Image& map, int max_cells = 1 << 21);

/// Returns the table of a map's cells. `probability`: that of the environment in the alias table. `through`: some
/// surface transmits light, so that light from behind counts.
std::vector<vec4> environment_warp(const EnvironmentCells& cells, double probability, bool through);
/// Returns the table of a constant environment.
std::vector<vec4> constant_environment(const vec3& radiance, double probability, bool through);

}  // namespace halflight
