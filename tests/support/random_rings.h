// Makes random pairs of triangles for tests of hierarchies.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "engine/rays/pairs.h"

namespace halflight::test {

/// Returns bent pairs: rings of four points, each within `size` along every axis of a random centre in [-1, 1]^3.
inline std::vector<rays::Ring> random_rings(std::size_t count, float size, std::uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> uniform(-1, 1);
    const auto point = [&] { return vec3(uniform(random), uniform(random), uniform(random)); };
    std::vector<rays::Ring> rings(count);
    for (rays::Ring& ring : rings) {
        const vec3 centre = point();
        for (vec3& p : ring) p = centre + size * point();
    }
    return rings;
}

}  // namespace halflight::test
