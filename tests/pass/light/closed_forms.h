// The oracle's BSDF of materials without textures, and irradiance of lights without extent.
#pragma once

#include <algorithm>
#include <cmath>

#include "engine/reference/bsdf.h"
#include "engine/scene/scene.h"

namespace halflight::test {

/// Returns the BSDF of a floor, whose normal is +y, seen from wo.
inline reference::Bsdf oracle_bsdf(const Material& m, const dvec3& wo) {
    const dvec3 up(0, 1, 0);
    reference::BsdfParameters p;
    p.base_color = dvec3(m.base_color);
    p.metallic = m.metallic, p.roughness = m.roughness;
    p.specular = m.specular, p.specular_color = m.specular_color, p.ior = m.ior;
    p.clearcoat = m.clearcoat, p.clearcoat_roughness = m.clearcoat_roughness, p.transmission = m.transmission;
    return {p, wo, up, up, up};
}

/// Returns the irradiance at a point of a surface (SHADING.md, "Lights").
inline dvec3 irradiance(const PunctualLight& l, const dvec3& position, const dvec3& normal) {
    const bool sun = l.type == LightType::directional;
    const dvec3 to = sun ? -dvec3(l.direction) : l.position - position;
    double e = std::max(glm::dot(glm::normalize(to), normal), 0.0) / (sun ? 1 : glm::dot(to, to));
    if (l.type == LightType::spot) {
        const double inner = std::cos(double(l.inner_cone)), outer = std::cos(double(l.outer_cone));
        const double along = -glm::dot(glm::normalize(to), glm::normalize(dvec3(l.direction)));
        const double cone = std::clamp((along - outer) / std::max(inner - outer, 1e-3), 0.0, 1.0);
        e *= cone * cone;
    }
    return dvec3(l.intensity) * e;
}

}  // namespace halflight::test
