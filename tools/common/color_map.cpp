#include "tools/common/color_map.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace halflight {

vec3 magma(float t) {
    static constexpr std::array<std::uint32_t, 10> kColors{0x000004, 0x180f3e, 0x451077, 0x721f81, 0x9f2f7f,
                                                           0xcd4071, 0xf1605d, 0xfd9567, 0xfec98d, 0xfcfdbf};
    const auto color = [](std::size_t i) {
        const std::uint32_t c = kColors[i];
        return vec3(c >> 16, c >> 8 & 255, c & 255) / 255.0f;
    };
    const float place = std::clamp(t, 0.0f, 1.0f) * (kColors.size() - 1);
    const auto below = std::min(static_cast<std::size_t>(place), kColors.size() - 2);
    return glm::mix(color(below), color(below + 1), place - static_cast<float>(below));
}

Image magma(const Image& map, double top) {
    assert(map.channels == 1 && top > 0);
    Image picture(map.width, map.height, 3);
    for (std::size_t i = 0; i < map.pixels.size(); ++i) {
        const float v = map.pixels[i];
        const vec3 color = std::isnan(v) ? vec3(0, 1, 0) : magma(static_cast<float>(v / top));
        for (std::size_t c = 0; c < 3; ++c) picture.pixels[3 * i + c] = color[static_cast<int>(c)];
    }
    return picture;
}

}  // namespace halflight
