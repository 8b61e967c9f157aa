#include "engine/tables/environment_warp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>

#include "engine/tables/luminance.h"
#include "shaders/shared/environment_texels.h"

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

void scale_to_one(Level& level) {
    const double sum = std::accumulate(level.sums.begin(), level.sums.end(), 0.0);
    for (double& weight : level.sums) weight /= sum > 0 ? sum : 1;
}

/// Returns the levels from `first` up to a single node. There are at least two.
std::vector<Level> levels_above(Level first) {
    std::vector<Level> levels{std::move(first)};
    while (levels.size() == 1 || levels.back().sums.size() > 1) levels.push_back(level_above(levels.back()));
    return levels;
}

/// A part of the map, seen as one direction.
struct Patch {
    dvec3 direction{0};
    double weight = 0;
    std::size_t block = 0;  // index of its block, row-major
};

/// Returns the normals by which a lobe is estimated: the middle of its cell of the octahedral map and the corners.
std::array<dvec3, 5> normals_of(int column, int row) {
    constexpr dvec2 kPlaces[] = {{0.5, 0.5}, {0, 0}, {1, 0}, {0, 1}, {1, 1}};
    std::array<dvec3, 5> normals;
    for (std::size_t i = 0; i < normals.size(); ++i) {
        const dvec2 p = (dvec2(column, row) + kPlaces[i]) * (2.0 / shared::kEnvironmentLobes) - 1.0;
        dvec3 n(p, 1 - std::abs(p.x) - std::abs(p.y));
        if (n.z < 0) n = {std::copysign(1 - std::abs(p.y), p.x), std::copysign(1 - std::abs(p.x), p.y), n.z};
        normals[i] = glm::normalize(n);
    }
    return normals;
}

/// Appends a lobe: the illuminance, and all levels above the blocks.
void append_lobe(std::vector<vec4>& table, Level blocks, double illuminance) {
    table.emplace_back(illuminance, 0, 0, 0);
    scale_to_one(blocks);
    const std::vector<Level> levels = levels_above(std::move(blocks));
    for (std::size_t k = levels.size() - 1; k > 0; --k)
        for (std::size_t y = 0; y < levels[k].rows; ++y)
            for (std::size_t x = 0; x < levels[k].columns; ++x) table.push_back(levels[k - 1].children(x, y));
}

/// Appends the lobes of all normals. `patches` has the blocks as a square of side 2^lobe_levels.
void append_lobes(std::vector<vec4>& table, const std::vector<Patch>& patches, int lobe_levels, double integral,
                  bool through) {
    // Lobes of materials that do not follow the cosine contribute at grazing angles, too. Patches reach a little below
    // the horizon.
    constexpr double kGrazing = 0.05, kHorizon = -0.05;
    const std::size_t side = std::size_t{1} << lobe_levels;
    constexpr int kSide = shared::kEnvironmentLobes;
    Level plain{side, side, std::vector<double>(side * side, 0)};
    for (const Patch& patch : patches) plain.sums[patch.block] += patch.weight;
    for (int lobe = 0; lobe < kSide * kSide; ++lobe) {
        const std::array<dvec3, 5> normals = normals_of(lobe % kSide, lobe / kSide);
        Level blocks{side, side, std::vector<double>(side * side, 0)};
        double illuminance = 0;
        for (const Patch& patch : patches) {
            double sum = 0, received = 0;
            for (const dvec3& n : normals) {
                const double cosine = through ? std::abs(glm::dot(n, patch.direction)) : glm::dot(n, patch.direction);
                received += std::max(cosine, 0.0) / normals.size();
                sum += cosine > kHorizon ? kGrazing + std::max(cosine, 0.0) : 0;
            }
            blocks.sums[patch.block] += patch.weight * sum;
            illuminance += patch.weight * received * integral;
        }
        append_lobe(table, std::move(blocks), illuminance);
    }
    append_lobe(table, std::move(plain), integral / 4);
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
    cells.texels = {map.width, map.height};
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
                    cells.weights[static_cast<std::size_t>(r * columns + c)] += share * (edge > 1 ? value.y : value.x);
                }
            }
        }
    }
    for (std::size_t i = 0; edge > 1 && i < cells.weights.size(); ++i) {
        cells.weights[i] = std::sqrt(cells.weights[i] * cells.solid_angles[i / static_cast<std::size_t>(columns)]);
    }
    return cells;
}

std::vector<vec4> environment_warp(const EnvironmentCells& cells, double probability, bool through) {
    Level finest{static_cast<std::size_t>(cells.columns), static_cast<std::size_t>(cells.rows), cells.weights};
    scale_to_one(finest);
    const std::vector<Level> levels = levels_above(std::move(finest));
    const auto top = static_cast<int>(levels.size()) - 1;
    const int lobe_levels = std::min(top, shared::kEnvironmentLobeLevels);

    const auto per_sine = 4 * kPi / cells.columns * std::sin(0.5 * kPi / cells.rows);
    std::vector<vec4> table{vec4(cells.columns, cells.rows, probability, top), vec4(per_sine, 0, 0, 0),
                            vec4(lobe_levels, cells.texels, 0)};
    for (int k = top; k > 0; --k) {
        const Level& level = levels[static_cast<std::size_t>(k)];
        if (k == top - lobe_levels) table[1].z = static_cast<float>(table.size());
        table[1].y = static_cast<float>(table.size());
        for (std::size_t y = 0; y < level.rows; ++y)
            for (std::size_t x = 0; x < level.columns; ++x)
                table.push_back(levels[static_cast<std::size_t>(k) - 1].children(x, y));
    }
    table[1].w = static_cast<float>(table.size());

    // Up to 4 x 4 patches make up a block.
    const int finer = std::min(top - lobe_levels, 2);
    const int covered = top - lobe_levels - finer;  // logarithm of the cells along a patch
    const Level& level = levels[static_cast<std::size_t>(covered)];
    std::vector<Patch> patches;
    for (std::size_t y = 0; y < level.rows; ++y) {
        for (std::size_t x = 0; x < level.columns; ++x) {
            if (level.at(x, y) == 0) continue;
            const auto middle = [&](std::size_t at, int size) {
                const double first = std::ldexp(double(at), covered), last = std::ldexp(double(at + 1), covered);
                return 0.5 * (first + std::min(last, double(size))) / size;
            };
            const double phi = 2 * kPi * (middle(x, cells.columns) - 0.5), theta = kPi * middle(y, cells.rows);
            patches.push_back({dvec3(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)),
                               level.at(x, y), ((y >> finer) << lobe_levels) + (x >> finer)});
        }
    }
    append_lobes(table, patches, lobe_levels, cells.integral, through);
    return table;
}

std::vector<vec4> constant_environment(const vec3& radiance, double probability, bool through) {
    const double illuminance = (through ? 2 : 1) * kPi * luminance_of(dvec3(radiance));
    return {vec4(0, 0, probability, 0), vec4(radiance, illuminance)};
}

}  // namespace halflight
