#include "engine/scene/area_light_shape.h"

#include <cmath>

namespace halflight {
namespace {

constexpr int kSides = 64;       // of a disc; its edge is within 0.1 % of the radius
constexpr float kDepth = 1e-3f;  // of the body behind a light and of its rim, in units of the light's size

}  // namespace

AreaLightShape area_light_shape(bool disc) {
    std::vector<vec3> ring{{-0.5f, -0.5f, 0}, {-0.5f, 0.5f, 0}, {0.5f, 0.5f, 0}, {0.5f, -0.5f, 0}};
    if (disc) {
        const double angle = 2 * kPi / kSides, radius = std::sqrt(kPi / 4 / (kSides / 2.0 * std::sin(angle)));
        ring.clear();
        for (int i = 0; i < kSides; ++i)
            ring.emplace_back(radius * std::cos(i * angle), -radius * std::sin(i * angle), 0);
    }
    AreaLightShape shape;
    constexpr float kRim = 1 + 2 * kDepth;  // factor of the rim's outer edge
    const vec3 depth(0, 0, kDepth);
    for (std::size_t i = 0; i < ring.size(); ++i) {
        const vec3 a = ring[i], b = ring[(i + 1) % ring.size()], c = kRim * a, d = kRim * b;
        shape.body.insert(shape.body.end(), {a, c, d, a, d, b, c, c + depth, d, d, c + depth, d + depth});
        if (i == 0 || i + 1 == ring.size()) continue;
        shape.front.insert(shape.front.end(), {ring[0], a, b});
        shape.body.insert(shape.body.end(), {kRim * ring[0] + depth, d + depth, c + depth});
    }
    return shape;
}

}  // namespace halflight
