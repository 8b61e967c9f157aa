#include "engine/reference/environment.h"

#include <algorithm>
#include <cmath>

namespace halflight::reference {
namespace {

dvec2 to_uv(const dvec3& d) {
    return {std::atan2(d.z, d.x) / (2 * kPi) + 0.5, std::acos(std::clamp(d.y, -1.0, 1.0)) / kPi};
}

int to_index(double coordinate, int size) {
    return std::clamp(static_cast<int>(coordinate * size), 0, size - 1);
}

}  // namespace

EnvironmentLight::EnvironmentLight(const Environment& environment) : environment_(environment) {
    const double tint = (environment.color.x + environment.color.y + environment.color.z) / 3.0;
    if (constant()) {
        power_ = 4 * kPi * tint;
        return;
    }
    // A texel's weight is the integral of the bilinear lookup over it: along each axis 1/8, 3/4, 1/8 of it and its
    // neighbours. Therefore every texel with radiance has a probability.
    const Image& map = environment.map;
    const auto value = [&](int x, int y) {
        const float* p = map.at((x + map.width) % map.width, std::clamp(y, 0, map.height - 1));
        const dvec3 c = dvec3(p[0], p[1], p[2]) * dvec3(environment.color);
        return (c.x + c.y + c.z) / 3;
    };
    const auto along_row = [&](int x, int y) { return (value(x - 1, y) + 6 * value(x, y) + value(x + 1, y)) / 8; };
    std::vector<double> row_weights(map.height), weights(map.width);
    for (int y = 0; y < map.height; ++y) {
        for (int x = 0; x < map.width; ++x) {
            weights[x] = (along_row(x, y - 1) + 6 * along_row(x, y) + along_row(x, y + 1)) / 8;
            row_weights[y] += weights[x] * solid_angle(y);
        }
        power_ += row_weights[y];
        columns_.emplace_back(weights);
    }
    rows_ = AliasTable(row_weights);
}

double EnvironmentLight::solid_angle(int row) const {
    const int height = environment_.map.height;
    return (std::cos(kPi * row / height) - std::cos(kPi * (row + 1) / height)) * 2 * kPi / environment_.map.width;
}

dvec3 EnvironmentLight::radiance(const dvec3& direction) const {
    const dvec3 tint(environment_.color);
    if (constant()) return tint;
    const Image& map = environment_.map;
    const dvec2 uv = to_uv(direction);
    const double x = uv.x * map.width - 0.5, y = uv.y * map.height - 0.5;
    const double i = std::floor(x), j = std::floor(y);
    const auto texel = [&](double column, double row) {
        const int wrapped = (static_cast<int>(column) + map.width) % map.width;
        const float* p = map.at(wrapped, std::clamp(static_cast<int>(row), 0, map.height - 1));
        return dvec3(p[0], p[1], p[2]);
    };
    return tint *
           mix(mix(texel(i, j), texel(i + 1, j), x - i), mix(texel(i, j + 1), texel(i + 1, j + 1), x - i), y - j);
}

dvec3 EnvironmentLight::sample(double u1, double u2) const {
    double phi = 2 * kPi * u1;
    double cosine = 1 - 2 * u2;
    if (!constant()) {
        const std::size_t row = rows_.choose(u2), column = columns_[row].choose(u1);
        const int height = environment_.map.height;
        phi = 2 * kPi * ((column + u1) / environment_.map.width - 0.5);
        cosine = glm::mix(std::cos(kPi * row / height), std::cos(kPi * (row + 1) / height), u2);
    }
    const double sine = std::sqrt(std::max(1 - cosine * cosine, 0.0));
    return {sine * std::cos(phi), cosine, sine * std::sin(phi)};
}

double EnvironmentLight::pdf(const dvec3& direction) const {
    if (black()) return 0;
    if (constant()) return 1 / (4 * kPi);
    const dvec2 uv = to_uv(direction);
    const int row = to_index(uv.y, environment_.map.height), column = to_index(uv.x, environment_.map.width);
    return rows_.probability(row) * columns_[row].probability(column) / solid_angle(row);
}

}  // namespace halflight::reference
