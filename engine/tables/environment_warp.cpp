#include "engine/tables/environment_warp.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "engine/tables/luminance.h"
#include "shaders/shared/environment.h"

namespace halflight {
namespace {

/// A level of the hierarchy: the sum of each node's weights.
struct Level {
    std::size_t columns = 0, rows = 0;
    std::vector<double> sums;  // row-major from the top

    double at(std::size_t x, std::size_t y) const { return x < columns && y < rows ? sums[y * columns + x] : 0; }
    vec4 children(std::size_t x, std::size_t y) const {
        return {at(2 * x, 2 * y), at(2 * x + 1, 2 * y), at(2 * x, 2 * y + 1), at(2 * x + 1, 2 * y + 1)};
    }
};

/// Returns the level above. Sums are those of the rounded weights that shaders read.
Level level_above(const Level& level) {
    Level above{(level.columns + 1) / 2, (level.rows + 1) / 2, {}};
    for (std::size_t y = 0; y < above.rows; ++y) {
        for (std::size_t x = 0; x < above.columns; ++x) {
            const dvec4 weights(level.children(x, y));
            above.sums.push_back(weights.x + weights.y + weights.z + weights.w);
        }
    }
    return above;
}

}  // namespace

EnvironmentCells environment_cells(const Image& map, int max_cells) {
    const std::int64_t width = map.width, height = map.height;
    std::int64_t edge = 1;  // maximum number of texels along a cell's edge
    while (((width + edge - 1) / edge) * ((height + edge - 1) / edge) > max_cells) ++edge;
    const std::int64_t columns = (width + edge - 1) / edge, rows = (height + edge - 1) / edge;

    const auto luminance_at = [&](std::int64_t x, std::int64_t y) {
        const float* texel =
            map.at(static_cast<int>((x + width) % width), static_cast<int>(std::clamp<std::int64_t>(y, 0, height - 1)));
        return luminance_of({texel[0], texel[1], texel[2]});
    };
    // Bilinear weights, integrated over a texel's square, are 1/8, 3/4 and 1/8 along each axis.
    const auto filtered = [&](std::int64_t x, std::int64_t y) {
        dvec2 sum(0);  // luminance and its square
        for (int j = -1; j <= 1; ++j) {
            for (int i = -1; i <= 1; ++i) {
                const double l = luminance_at(x + i, y + j);
                sum += (i == 0 ? 0.75 : 0.125) * (j == 0 ? 0.75 : 0.125) * dvec2(l, l * l);
            }
        }
        return sum;
    };
    const auto band = [](double v0, double v1) {  // solid angle between two polar angles, in pi
        return 4 * kPi * std::sin(0.5 * kPi * (v0 + v1)) * std::sin(0.5 * kPi * (v1 - v0));
    };

    EnvironmentCells cells;
    cells.columns = static_cast<int>(columns);
    cells.rows = static_cast<int>(rows);
    cells.weights.assign(static_cast<std::size_t>(columns * rows), 0);
    for (std::int64_t r = 0; r < rows; ++r) {
        cells.solid_angles.push_back(band(double(r) / double(rows), double(r + 1) / double(rows)) / double(columns));
    }
    std::vector<dvec2> row(static_cast<std::size_t>(width));
    for (std::int64_t y = 0; y < height; ++y) {
        for (std::int64_t x = 0; x < width; ++x) row[static_cast<std::size_t>(x)] = filtered(x, y);
        for (std::int64_t r = y * rows / height; r * height < (y + 1) * rows; ++r) {
            const double solid = band(std::max(double(y) / double(height), double(r) / double(rows)),
                                      std::min(double(y + 1) / double(height), double(r + 1) / double(rows)));
            for (std::int64_t x = 0; x < width; ++x) {
                const dvec2& value = row[static_cast<std::size_t>(x)];
                for (std::int64_t c = x * columns / width; c * width < (x + 1) * columns; ++c) {
                    const std::int64_t overlap =
                        std::min((x + 1) * columns, (c + 1) * width) - std::max(x * columns, c * width);
                    const double share = solid * double(overlap) / double(width * columns);
                    cells.integral += share * value.x;
                    cells.weights[static_cast<std::size_t>(r * columns + c)] += share * value.y;
                }
            }
        }
    }
    for (std::size_t i = 0; i < cells.weights.size(); ++i) {
        cells.weights[i] = std::sqrt(cells.weights[i] * cells.solid_angles[i / static_cast<std::size_t>(columns)]);
    }
    return cells;
}

std::vector<vec4> environment_warp(const EnvironmentCells& cells, double probability) {
    const double sum = std::accumulate(cells.weights.begin(), cells.weights.end(), 0.0);
    std::vector<Level> levels(1);
    levels[0] = {static_cast<std::size_t>(cells.columns), static_cast<std::size_t>(cells.rows), cells.weights};
    for (double& weight : levels[0].sums) weight /= sum;
    while (levels.size() == 1 || levels.back().sums.size() > 1) levels.push_back(level_above(levels.back()));

    const double step = kPi / cells.rows;
    const auto per_sine = static_cast<float>(4 * kPi / cells.columns * std::sin(0.5 * step));
    std::vector<vec4> table{vec4(cells.columns, cells.rows, probability, levels.size() - 1), vec4(0, per_sine, 0, 0)};
    for (std::size_t k = levels.size() - 1; k > 0; --k) {
        table[1].x = static_cast<float>(table.size());
        for (std::size_t y = 0; y < levels[k].rows; ++y)
            for (std::size_t x = 0; x < levels[k].columns; ++x) table.push_back(levels[k - 1].children(x, y));
    }
    return table;
}

std::vector<vec4> constant_environment(const vec3& radiance, double probability) {
    return {vec4(0, 0, probability, 0), vec4(radiance, 0)};
}

}  // namespace halflight
