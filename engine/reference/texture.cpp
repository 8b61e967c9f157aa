#include "engine/reference/texture.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace halflight::reference {
namespace {

/// Decodes the sRGB curve (IEC 61966-2-1).
double decode_srgb(double s) {
    return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}

std::array<double, 256> build_srgb_table() {
    std::array<double, 256> table;
    for (int i = 0; i < 256; ++i) table[i] = decode_srgb(i / 255.0);
    return table;
}

/// Wraps an unbounded texel index like OpenGL.
int wrap_index(std::int64_t i, int size, Wrap wrap) {
    switch (wrap) {
        case Wrap::repeat:
            return static_cast<int>(((i % size) + size) % size);
        case Wrap::mirrored_repeat: {
            const std::int64_t m = ((i % (2 * size)) + 2 * size) % (2 * size);
            return static_cast<int>(m < size ? m : 2 * size - 1 - m);
        }
        case Wrap::clamp_to_edge:
            break;
    }
    return static_cast<int>(std::clamp<std::int64_t>(i, 0, size - 1));
}

/// Wraps a coordinate to the range of integers without changing the lookup; 0 for values that are not finite.
double wrap_coordinate(double u, Wrap wrap) {
    if (!std::isfinite(u)) return 0;
    switch (wrap) {
        case Wrap::repeat:
            return u - std::floor(u);
        case Wrap::mirrored_repeat:
            return u - 2 * std::floor(u / 2);
        case Wrap::clamp_to_edge:
            break;
    }
    return std::clamp(u, 0.0, 1.0);
}

}  // namespace

dvec4 sample_texture(const Scene& scene, const TextureRef& ref, const dvec2& uv, Encoding encoding) {
    static const std::array<double, 256> srgb = build_srgb_table();
    const TextureImage& image = scene.images[static_cast<std::size_t>(ref.image)];
    const dvec2 at = glm::dmat3x2(ref.uv_transform) * dvec3(uv, 1);
    const double x = wrap_coordinate(at.x, ref.wrap_u) * image.width;
    const double y = wrap_coordinate(at.y, ref.wrap_v) * image.height;

    const auto texel = [&](double column, double row) {
        const int i = wrap_index(static_cast<std::int64_t>(column), image.width, ref.wrap_u);
        const int j = wrap_index(static_cast<std::int64_t>(row), image.height, ref.wrap_v);
        const std::size_t place = static_cast<std::size_t>(j) * image.width + i;
        if (image.deep) {
            const std::uint8_t* high = &image.rgba[8 * place];
            dvec4 value;
            for (int c = 0; c < 4; ++c) value[c] = (256 * high[c] + high[c + 4]) / 65535.0;
            for (int c = 0; c < 3 && encoding == Encoding::srgb; ++c) value[c] = decode_srgb(value[c]);
            return value;
        }
        const std::uint8_t* p = &image.rgba[4 * place];
        if (encoding == Encoding::srgb) return dvec4(srgb[p[0]], srgb[p[1]], srgb[p[2]], p[3] / 255.0);
        return dvec4(p[0], p[1], p[2], p[3]) / 255.0;
    };
    if (ref.nearest) return texel(std::floor(x), std::floor(y));
    const double i = std::floor(x - 0.5), j = std::floor(y - 0.5);
    const double s = x - 0.5 - i, t = y - 0.5 - j;
    return mix(mix(texel(i, j), texel(i + 1, j), s), mix(texel(i, j + 1), texel(i + 1, j + 1), s), t);
}

}  // namespace halflight::reference
