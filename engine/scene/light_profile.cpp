#include "engine/scene/light_profile.h"

#include <algorithm>
#include <cmath>

#include "engine/scene/scene.h"

namespace halflight {
namespace {

/// Returns the integral of a v + b over sin v dv from v0 to v1, for the line through (v0, y0) and (v1, y1).
double integral_over_sine(double v0, double y0, double v1, double y1) {
    const double a = (y1 - y0) / (v1 - v0);
    return y0 * std::cos(v0) - y1 * std::cos(v1) + a * (std::sin(v1) - std::sin(v0));
}

/// Returns a unit vector orthogonal to the unit vector z, near v if that is possible.
dvec3 orthogonal(const dvec3& v, const dvec3& z) {
    const dvec3 rest = v - glm::dot(v, z) * z;
    const double length = glm::length(rest);
    if (length > 1e-9 * glm::length(v)) return rest / length;
    return glm::normalize(glm::cross(z, std::abs(z.x) < 0.5 ? dvec3(1, 0, 0) : dvec3(0, 1, 0)));
}

}  // namespace

double mean_share(const LightProfile& profile) {
    const std::size_t rows = profile.vertical.size(), columns = profile.horizontal.size();
    double sum = 0;
    for (std::size_t h = 0; h < columns; ++h) {
        const double before = h > 0 ? profile.horizontal[h] - profile.horizontal[h - 1] : 0;
        const double after = h + 1 < columns ? profile.horizontal[h + 1] - profile.horizontal[h] : 0;
        const double weight = columns == 1 ? 1 : 0.5 * (before + after) / (2 * kPi);  // trapezoidal rule
        for (std::size_t v = 0; v + 1 < rows; ++v)
            sum += weight * integral_over_sine(profile.vertical[v], profile.shares[h * rows + v],
                                               profile.vertical[v + 1], profile.shares[h * rows + v + 1]);
    }
    return std::clamp(sum / 2, 0.0, 1.0);
}

LitCone lit_cone(const LightProfile& profile) {
    const std::size_t rows = profile.vertical.size();
    dvec2 lit(kPi, 0);  // least and greatest vertical angle
    for (std::size_t i = 0; i < profile.shares.size(); ++i) {
        if (!(profile.shares[i] > 0)) continue;
        const std::size_t v = i % rows;
        lit.x = std::min(lit.x, double{profile.vertical[v > 0 ? v - 1 : 0]});
        lit.y = std::max(lit.y, double{profile.vertical[std::min(v + 1, rows - 1)]});
    }
    LitCone cone;
    if (!(lit.x < lit.y)) return cone;
    cone.reversed = kPi - lit.x < lit.y;
    cone.angle = std::min(cone.reversed ? kPi - lit.x : lit.y, kPi);
    cone.share = std::min(2 * mean_share(profile) / (1 - std::cos(cone.angle)), 1.0);
    return cone;
}

void set_profile_axes(PunctualLight& light, const dmat3& to_world) {
    const dvec3 z = -glm::normalize(dvec3(light.direction));
    const dvec3 x = orthogonal(to_world[0], z);
    const dvec3 y = glm::cross(z, x);
    light.right = vec3(x);
    light.up = vec3(glm::dot(to_world[1], y) < 0 ? -y : y);  // a transform may mirror
}

void turn_profile_axes(PunctualLight& light, const vec3& before) {
    const dvec3 from = glm::normalize(dvec3(before)), to = glm::normalize(dvec3(light.direction));
    const double cosine = glm::dot(from, to);
    const dvec3 axis = glm::cross(from, to);
    dmat3 axes{dvec3(light.right), dvec3(light.up), dvec3(0)};
    for (int i = 0; i < 2; ++i) {
        dvec3& v = axes[i];
        if (cosine > -0.9999999)
            v = cosine * v + glm::cross(axis, v) + axis * (glm::dot(axis, v) / (1 + cosine));  // Rodrigues
        else if (i == 1)
            v = -v;  // half a turn about `right`
    }
    set_profile_axes(light, axes);
}

}  // namespace halflight
