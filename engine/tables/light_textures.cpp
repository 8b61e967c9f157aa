#include "engine/tables/light_textures.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/scene/image_tiles.h"

namespace halflight {
namespace {

struct Range {
    int first, last;  // texel indices, both included
};

/// Returns the texels of one axis that lookups at coordinates in [lower, upper] (before wrapping) can touch.
std::vector<Range> touched(double lower, double upper, int size, Wrap wrap) {
    // One texel covers the footprint of the bilinear filter, another one the rounding of float coordinates. Rounding is
    // smaller than a texel for |u| size < 2^22; beyond that, all texels count.
    const double from = std::floor(lower * size) - 2;
    const double to = std::floor(upper * size) + 2;
    if (!(std::max(std::abs(from), std::abs(to)) < 0x1p22)) return {{0, size - 1}};
    if (wrap == Wrap::clamp_to_edge) {
        return {
            {static_cast<int>(std::clamp(from, 0.0, size - 1.0)), static_cast<int>(std::clamp(to, 0.0, size - 1.0))}};
    }
    if (to - from + 1 >= size) return {{0, size - 1}};
    std::vector<Range> ranges;
    for (double start = from; start <= to;) {
        const double period = std::floor(start / size);
        const double end = std::min(to, (period + 1) * size - 1);
        int first = static_cast<int>(start - period * size);
        int last = static_cast<int>(end - period * size);
        if (wrap == Wrap::mirrored_repeat && std::fmod(period, 2) != 0) {
            first = size - 1 - std::exchange(last, size - 1 - first);
        }
        ranges.push_back({first, last});
        start = end + 1;
    }
    return ranges;
}

}  // namespace

LuminanceSums::LuminanceSums(const TextureImage& image)
    : size_(image.width, image.height),
      sums_(static_cast<std::size_t>(image.width + 1) * static_cast<std::size_t>(image.height + 1), 0) {
    std::vector<double> linear(image.largest() + 1);
    for (std::size_t i = 0; i < linear.size(); ++i) linear[i] = srgb_to_linear(double(i) / image.largest());
    const std::size_t pitch = static_cast<std::size_t>(size_.x) + 1;
    const std::vector<std::uint8_t> read = image.tiles ? all_texels(image) : std::vector<std::uint8_t>();
    const std::uint8_t* texel = image.tiles ? read.data() : image.rgba.data();
    for (std::size_t y = 1; y <= static_cast<std::size_t>(size_.y); ++y) {
        std::uint64_t row = 0;
        for (std::size_t x = 1; x < pitch; ++x, texel += image.texel_bytes()) {
            const auto value = [&](std::size_t c) { return linear[image.code(texel, c)]; };
            const double luminance = 0.2126 * value(0) + 0.7152 * value(1) + 0.0722 * value(2);
            row += static_cast<std::uint64_t>(std::ceil(luminance * 0x1p20));
            sums_[y * pitch + x] = sums_[(y - 1) * pitch + x] + row;
        }
    }
}

std::uint64_t LuminanceSums::sum(ivec2 lower, ivec2 upper) const {
    const auto at = [&](int x, int y) {
        return sums_[static_cast<std::size_t>(y) * (static_cast<std::size_t>(size_.x) + 1) +
                     static_cast<std::size_t>(x)];
    };
    return at(upper.x + 1, upper.y + 1) - at(lower.x, upper.y + 1) - at(upper.x + 1, lower.y) + at(lower.x, lower.y);
}

double LuminanceSums::mean(const TextureRef& texture, const std::array<vec2, 3>& uvs) const {
    vec2 lower(kInfinity), upper(-kInfinity);
    for (const vec2& st : uvs) {
        const vec2 uv = texture.uv_transform * vec3(st, 1);
        lower = glm::min(lower, uv);
        upper = glm::max(upper, uv);
    }
    double total = 0, count = 0;
    for (const Range& y : touched(lower.y, upper.y, size_.y, texture.wrap_v)) {
        for (const Range& x : touched(lower.x, upper.x, size_.x, texture.wrap_u)) {
            total += static_cast<double>(sum({x.first, y.first}, {x.last, y.last}));
            count += (x.last - x.first + 1.0) * (y.last - y.first + 1.0);
        }
    }
    return total / count * 0x1p-20;
}

}  // namespace halflight
